/* The process as the system sees it: its streams, its signals, the address space left. Fortran's side is process.f90. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stddef.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

enum { longest_path = 8192 };

/* What goes if a signal ends the process: the file that is being written, and the lock. */
enum { unfinished_file, held_lock, kinds_to_remove };
static char to_remove[kinds_to_remove][longest_path];
static volatile sig_atomic_t is_to_be_removed[kinds_to_remove];

static void note(int kind, const char *path)
{
   is_to_be_removed[kind] = 0;
   const size_t length = strlen(path);
   if (length >= longest_path) return;
   memcpy(to_remove[kind], path, length + 1);
   is_to_be_removed[kind] = length > 0;
}

/* The file that is being written; once it has its final name there is none of this name. */
void impactbeam_note_unfinished(const char *path)
{
   note(unfinished_file, path);
}

/* The lock that is held; none: "". */
void impactbeam_note_lock(const char *path)
{
   note(held_lock, path);
}

/* End as the signal would have ended the process: whoever waits for it sees the signal. */
static void end_by_signal(int number)
{
   for (int kind = 0; kind < kinds_to_remove; ++kind) {
      if (is_to_be_removed[kind]) unlink(to_remove[kind]);
   }
   signal(number, SIG_DFL);
   raise(number);
}

/* libgfortran prints a backtrace at SIGQUIT and SIGXCPU; these and the rest that ask a process to end leave no unfinished
 * file. Past a limit on the size of files write() shall fail. What is ignored from outside (nohup) stays so. */
void impactbeam_take_signals(void)
{
   static const int ending[] = {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXCPU, SIGUSR1, SIGUSR2, SIGPIPE, SIGALRM,
                                SIGVTALRM, SIGPROF};
   struct sigaction action = {.sa_handler = end_by_signal}, former;
   sigemptyset(&action.sa_mask);
   for (size_t i = 0; i < sizeof ending / sizeof *ending; ++i) {
      if (sigaction(ending[i], NULL, &former) == 0 && former.sa_handler != SIG_IGN) sigaction(ending[i], &action, NULL);
   }
   signal(SIGXFSZ, SIG_IGN);
}

/* Where standard input, output or error is closed the next file to be opened would take its place and be written to. What
 * takes it here can only be read, so that what is printed there fails. */
void impactbeam_hold_streams(void)
{
   for (int stream = 0; stream <= 2; ++stream) {
      if (fcntl(stream, F_GETFD) < 0 && open("/dev/null", O_RDONLY) != stream) return;
   }
}

/* Write all bytes; 0, or the errno of what failed. */
int impactbeam_write_all(int descriptor, const char *bytes, size_t count)
{
   while (count > 0) {
      const ssize_t written = write(descriptor, bytes, count);
      if (written > 0) {
         bytes += written;
         count -= (size_t)written;
      } else if (written == 0) {
         return EIO;
      } else if (errno != EINTR) {
         return errno;
      }
   }
   return 0;
}
