/* The processes that share a sweep, by MPI: what rank_calls.f90 loads. Each call takes a number and gives one; what means
 * nothing is 0. */
#include <mpi.h>

enum { tag_question = 1, tag_answer = 2 };

/* 1: threads may take turns. */
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

/* Wait for all. */
int impactbeam_rank_meet(int unused)
{
   MPI_Barrier(MPI_COMM_WORLD);
   return unused;
}

/* The greatest value that any process has. */
int impactbeam_rank_greatest(int value)
{
   MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
   return value;
}

/* Ask the first process, and take its answer. */
int impactbeam_rank_ask(int question)
{
   MPI_Send(&question, 1, MPI_INT, 0, tag_question, MPI_COMM_WORLD);
   MPI_Recv(&question, 1, MPI_INT, 0, tag_answer, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
   return question;
}

/* Has any process asked? waits: it will. */
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

/* Answer one that has asked. */
int impactbeam_rank_answer(int answer)
{
   int question;
   MPI_Status status;
   MPI_Recv(&question, 1, MPI_INT, MPI_ANY_SOURCE, tag_question, MPI_COMM_WORLD, &status);
   MPI_Send(&answer, 1, MPI_INT, status.MPI_SOURCE, tag_answer, MPI_COMM_WORLD);
   return question;
}
