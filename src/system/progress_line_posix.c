/* A line that counts the seconds of a long run, written from a timer: the arithmetic below knows nothing of it.
 * The handler only uses what POSIX allows in one. Fortran's side is progress_line.f90. */
#include <errno.h>
#include <signal.h>
#include <stddef.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum { longest_label = 160, room_for_seconds = 32, milliseconds_between_lines = 1000, usual_width = 80 };

static char line[longest_label + room_for_seconds];
static size_t label_length;
static int line_descriptor;
static struct timespec begin;
static volatile sig_atomic_t line_is_shown;

static void set_timer(int first, int between)
{
   const struct itimerval timer = {
      .it_value = {.tv_sec = first / 1000, .tv_usec = first % 1000 * 1000},
      .it_interval = {.tv_sec = between / 1000, .tv_usec = between % 1000 * 1000}};
   setitimer(ITIMER_REAL, &timer, NULL);
}

/* Columns of a terminal; 80 where they are not known. */
int impactbeam_terminal_width(int descriptor)
{
   struct winsize size;
   if (ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return usual_width;
   return size.ws_col;
}

static void show_line(int signal_number)
{
   (void)signal_number;
   const int saved = errno;
   struct timespec now;
   clock_gettime(CLOCK_MONOTONIC, &now);
   long seconds = (long)(now.tv_sec - begin.tv_sec) - (now.tv_nsec < begin.tv_nsec);
   char digits[20];
   size_t count = 0, length = label_length;
   do {
      digits[count++] = (char)('0' + seconds % 10);
      seconds /= 10;
   } while (seconds > 0 && count < sizeof digits);
   while (count > 0) line[length++] = digits[--count];
   line[length++] = ' ';
   line[length++] = 's';
   /* a line that wraps could not be written over; the first byte goes back to its beginning */
   const size_t width = (size_t)impactbeam_terminal_width(line_descriptor);
   if (length > width) length = width;
   line_is_shown = 1;
   if (write(line_descriptor, line, length) < 0) line_is_shown = 0;
   errno = saved;
}

/* After so many milliseconds, and then each second, write the label and the seconds since now. */
void impactbeam_start_progress(const char *label, int descriptor, int delay)
{
   label_length = strlen(label);
   if (label_length > longest_label - 2) label_length = longest_label - 2;
   line[0] = '\r';
   memcpy(line + 1, label, label_length);
   line[label_length + 1] = ' ';
   label_length += 2;
   line_descriptor = descriptor;
   line_is_shown = 0;
   clock_gettime(CLOCK_MONOTONIC, &begin);
   struct sigaction action = {.sa_handler = show_line, .sa_flags = SA_RESTART};
   sigemptyset(&action.sa_mask);
   sigaction(SIGALRM, &action, NULL);
   set_timer(delay, milliseconds_between_lines);
}

/* Stop, and wipe the line out where one was written. */
void impactbeam_stop_progress(void)
{
   set_timer(0, 0);
   signal(SIGALRM, SIG_IGN);
   if (!line_is_shown) return;
   static const char wipe[] = "\r\033[K";
   if (write(line_descriptor, wipe, sizeof wipe - 1) < 0) return;
   line_is_shown = 0;
}
