/* Standard streams, signals, stack and end of this process. process.f90 has the Fortran interfaces. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

enum { longest_path = 8192 };

/* Files that are removed if a signal or lack of memory ends the process: the file that is being written, and the lock. */
enum { unfinished_file, owned_lock, kinds_to_remove };
static char to_remove[kinds_to_remove][longest_path];
static volatile sig_atomic_t is_to_be_removed[kinds_to_remove];

/* Record a path to be removed; a path that is too long or empty is not recorded. */
static void record_path(int kind, const char *path)
{
   is_to_be_removed[kind] = 0;
   const size_t length = strlen(path);
   if (length >= longest_path) return;
   memcpy(to_remove[kind], path, length + 1);
   is_to_be_removed[kind] = length > 0;
}

/* Record the path of the file that is being written. Once the file has its final name no file of this path exists. */
void impactbeam_note_unfinished(const char *path)
{
   record_path(unfinished_file, path);
}

/* Record the path of the lock file that this process owns; "" if there is none. */
void impactbeam_note_lock(const char *path)
{
   record_path(owned_lock, path);
}

static void remove_unfinished(void)
{
   for (int kind = 0; kind < kinds_to_remove; ++kind) {
      if (is_to_be_removed[kind]) unlink(to_remove[kind]);
   }
}

/* Remove unfinished files and end by the default action of the signal, so that the parent process sees the signal. */
static void end_by_signal(int number)
{
   remove_unfinished();
   signal(number, SIG_DFL);
   raise(number);
}

/* Catch the signals that ask a process to end, so that no unfinished file is left and libgfortran prints no backtrace at
 * SIGQUIT and SIGXCPU. Beyond a limit on the size of files write() shall fail. Signals that were ignored at the start of
 * the process (nohup) stay ignored. */
void impactbeam_catch_signals(void)
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

/* Open /dev/null for reading in place of a closed standard input, output or error. Otherwise the next file to be opened
 * would get the free descriptor and receive the printed text. Printing to the read-only /dev/null fails as it should. */
void impactbeam_reserve_streams(void)
{
   for (int stream = 0; stream <= 2; ++stream) {
      if (fcntl(stream, F_GETFD) < 0 && open("/dev/null", O_RDONLY) != stream) return;
   }
}

/* Let glibc retain more freed memory, because freed memory is usually allocated again at once and the system would clear
 * each page that it hands out again. The first part of the heap is mapped in huge pages if the system has them, because
 * small pages would take thousands of page faults in a driven run. */
void impactbeam_retain_memory(void)
{
#ifdef __GLIBC__
   mallopt(M_MMAP_THRESHOLD, 4 << 20);
   mallopt(M_TRIM_THRESHOLD, 16 << 20);
#ifdef MADV_HUGEPAGE
   enum { huge_page = 2 << 20, huge_part = 14 << 20, first_part = 1 << 20 };
   mallopt(M_TOP_PAD, huge_part);
   char *const heap = sbrk(0);
   /* A block that is not used ends near a boundary between huge pages, so that all later blocks are in huge pages. It is
    * larger than the first part of the heap, so that the heap grows. */
   size_t size = huge_page - (uintptr_t)heap%huge_page;
   if (size < first_part) size += huge_page;
   static void *volatile unused;
   unused = malloc(size);
   (void)unused;
   if (heap != (void *)-1 && (char *)sbrk(0) - heap > huge_part) madvise(heap, huge_part, MADV_HUGEPAGE);
#endif
   mallopt(M_TOP_PAD, 1 << 20);
#endif
}

/* Write all bytes. Returns 0, or the errno of the call that failed. */
int impactbeam_write_all(int descriptor, const char *bytes, size_t count)
{
   /* Beyond a limit on the size of files write() shall fail instead of ending the program. */
   void (*const former)(int) = signal(SIGXFSZ, SIG_IGN);
   int code = 0;
   while (count > 0 && code == 0) {
      const ssize_t written = write(descriptor, bytes, count);
      if (written > 0) {
         bytes += written;
         count -= (size_t)written;
      } else if (written == 0) {
         code = EIO;
      } else if (errno != EINTR) {
         code = errno;
      }
   }
   if (former != SIG_ERR) signal(SIGXFSZ, former);
   return code;
}

/* Call `work` on a stack of at least the default size, and make this size the default of later threads. A smaller limit of
 * the user (ulimit -s) may be final for the main thread, and linear algebra alone takes some 60 kB; the stack size of a new
 * thread is not bound by the limit. */
void impactbeam_work_on_usual_stack(void *(*work)(void *), void *data)
{
   static const rlim_t usual = (rlim_t)8 << 20;
   struct rlimit limit;
   pthread_attr_t attributes;
   pthread_t thread;
   int is_done = 0;
   if (getrlimit(RLIMIT_STACK, &limit) == 0 && limit.rlim_cur < usual && pthread_attr_init(&attributes) == 0) {
      if (pthread_attr_setstacksize(&attributes, usual) == 0) {
#ifdef __GLIBC__
         pthread_setattr_default_np(&attributes);
#endif
         is_done = pthread_create(&thread, &attributes, work, data) == 0 && pthread_join(thread, NULL) == 0;
      }
      pthread_attr_destroy(&attributes);
   }
   if (!is_done) work(data);
}

/* libgfortran calls these functions when an allocation without a status fails, and its own versions print a backtrace. The
 * program's versions take precedence over those of the shared library, and over those of the static library if the linker
 * is told so (--wrap). They remove unfinished files and exit with status 1. */
void _gfortran_os_error(const char *message) __attribute__((weak, noreturn));
void _gfortran_os_error_at(const char *place, const char *message, ...) __attribute__((weak, noreturn));

void __wrap__gfortran_os_error(const char *message) __attribute__((noreturn, alias("_gfortran_os_error")));
void __wrap__gfortran_os_error_at(const char *place, const char *message, ...)
   __attribute__((noreturn, alias("_gfortran_os_error_at")));

static void end_without_memory(const char *message, va_list arguments) __attribute__((noreturn));

static void end_without_memory(const char *message, va_list arguments)
{
   char text[256], what[160];
   vsnprintf(what, sizeof what, message, arguments);
   const int length = snprintf(text, sizeof text, "impactbeam: memory has run out (%s); give the scene less to do, or the "
                               "program more memory\n", what);
   remove_unfinished();
   if (length > 0) (void)impactbeam_write_all(STDERR_FILENO, text, (size_t)length);
   _exit(1);
}

void _gfortran_os_error_at(const char *place, const char *message, ...)
{
   (void)place;
   va_list arguments;
   va_start(arguments, message);
   end_without_memory(message, arguments);
}

static void end_with_message(const char *message, ...) __attribute__((noreturn));

static void end_with_message(const char *message, ...)
{
   va_list arguments;
   va_start(arguments, message);
   end_without_memory(message, arguments);
}

void _gfortran_os_error(const char *message)
{
   end_with_message("%s", message);
}
