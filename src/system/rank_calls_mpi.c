/* Communication by MPI of the processes (ranks) that share a sweep, in a library that rank_calls.f90 loads. Each call takes
 * an integer and returns one; arguments and results without meaning are 0. */
#include <mpi.h>

enum { tag_question = 1, tag_answer = 2 };

/* Start MPI. Returns 1 if threads may call MPI one at a time, else 0. */
int impactbeam_rank_start(int unused)
{
   int provided;
   MPI_Init_thread(NULL, NULL, MPI_THREAD_SERIALIZED, &provided);
   return unused + (provided >= MPI_THREAD_SERIALIZED);
}

int impactbeam_rank_stop(int unused)
{
   MPI_Finalize();
   return unused;
}

int impactbeam_rank_number(int unused)
{
   MPI_Comm_rank(MPI_COMM_WORLD, &unused);
   return unused;
}

int impactbeam_rank_count(int unused)
{
   MPI_Comm_size(MPI_COMM_WORLD, &unused);
   return unused;
}

/* Wait until all ranks have made this call. */
int impactbeam_rank_meet(int unused)
{
   MPI_Barrier(MPI_COMM_WORLD);
   return unused;
}

/* Maximum value over all ranks. */
int impactbeam_rank_greatest(int value)
{
   MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
   return value;
}

/* Send a question to the first rank and return its answer. */
int impactbeam_rank_ask(int question)
{
   MPI_Send(&question, 1, MPI_INT, 0, tag_question, MPI_COMM_WORLD);
   MPI_Recv(&question, 1, MPI_INT, 0, tag_answer, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
   return question;
}

/* Whether any rank has sent a question. If `waits`, wait until one has. */
int impactbeam_rank_is_asked(int waits)
{
   int is_asked = 1;
   if (waits) {
      MPI_Probe(MPI_ANY_SOURCE, tag_question, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
   } else {
      MPI_Iprobe(MPI_ANY_SOURCE, tag_question, MPI_COMM_WORLD, &is_asked, MPI_STATUS_IGNORE);
   }
   return is_asked;
}

/* Answer a rank that has sent a question, and return the question. */
int impactbeam_rank_answer(int answer)
{
   int question;
   MPI_Status status;
   MPI_Recv(&question, 1, MPI_INT, MPI_ANY_SOURCE, tag_question, MPI_COMM_WORLD, &status);
   MPI_Send(&answer, 1, MPI_INT, status.MPI_SOURCE, tag_answer, MPI_COMM_WORLD);
   return question;
}
