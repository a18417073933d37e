/* A progress line that counts the seconds of a long run. A timer signal writes the line, so the computation needs no calls.
 * The signal handler only calls functions that POSIX declares safe in one. progress_line.f90 has the Fortran interfaces. */
#include <errno.h>
#include <signal.h>
#include <stddef.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum { longest_label = 160, room_for_figures = 96, milliseconds_between_lines = 1000, usual_width = 80 };

static char line[longest_label + room_for_figures];
static size_t label_length;
static int line_descriptor;
static struct timespec begin;
/* Completed fraction of the run, 0 to 1; its value at the last line; and fraction and second from which the rate of
 * progress is counted */
static volatile const double *fraction;
static double last_fraction, first_fraction, first_second;
static volatile sig_atomic_t line_is_shown;
static int is_started = 0;

static void set_timer(int first, int between)
{
   const struct itimerval timer = {
      .it_value = {.tv_sec = first / 1000, .tv_usec = first % 1000 * 1000},
      .it_interval = {.tv_sec = between / 1000, .tv_usec = between % 1000 * 1000}};
   setitimer(ITIMER_REAL, &timer, NULL);
}

/* Number of columns of a terminal; 80 if unknown. */
int impactbeam_terminal_width(int descriptor)
{
   struct winsize size;
   if (ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return usual_width;
   return size.ws_col;
}

static size_t add_number(size_t length, long number)
{
   char digits[20];
   size_t count = 0;
   do {
      digits[count++] = (char)('0' + number % 10);
      number /= 10;
   } while (number > 0 && count < sizeof digits);
   while (count > 0) line[length++] = digits[--count];
   return length;
}

static size_t add_words(size_t length, const char *words)
{
   while (*words != '\0') line[length++] = *words++;
   return length;
}

/* Append the completed fraction and the remaining time at a constant rate of progress, such as ', 45 %, 12 s left'. */
static size_t add_fraction(size_t length, double seconds)
{
   const double now = *fraction;
   /* a smaller fraction belongs to the next run, whose rate is counted from here */
   const int is_new = now < last_fraction;
   last_fraction = now;
   if (is_new) {
      first_fraction = now;
      first_second = seconds;
   }
   if (!(now > 0.0 && now <= 1.0)) return length;
   length = add_number(add_words(length, ", "), (long)(100.0 * now));
   length = add_words(length, " %");
   if (!(now > first_fraction)) return length;
   const double left = (seconds - first_second) * (1.0 - now) / (now - first_fraction);
   length = add_words(length, ", ");
   if (left < 600.0)
      length = add_words(add_number(length, (long)(left + 0.5)), " s left");
   else if (left < 36000.0)
      length = add_words(add_number(length, (long)(left / 60.0 + 0.5)), " min left");
   else
      length = add_words(add_number(length, left < 1e9 ? (long)(left / 3600.0 + 0.5) : 277778), " h left");
   return length;
}

static void show_line(int signal_number)
{
   (void)signal_number;
   const int saved = errno;
   struct timespec now;
   clock_gettime(CLOCK_MONOTONIC, &now);
   const double seconds = (double)(now.tv_sec - begin.tv_sec) + 1e-9 * (double)(now.tv_nsec - begin.tv_nsec);
   const size_t seconds_end = add_words(add_number(label_length, (long)seconds), " s");
   size_t length = add_fraction(seconds_end, seconds);
   /* a line that wraps could not be overwritten; the first byte of the line is a carriage return */
   const size_t width = (size_t)impactbeam_terminal_width(line_descriptor);
   if (length > width)
      length = width;
   else if (length > seconds_end)
      length = add_words(length, "\033[K"); /* erase the rest of a longer previous line */
   line_is_shown = 1;
   if (write(line_descriptor, line, length) < 0) line_is_shown = 0;
   errno = saved;
}

/* Write label, seconds from now and completed fraction after `delay` milliseconds, and then every second. */
void impactbeam_start_progress(const char *label, int descriptor, int delay, const double *where)
{
   fraction = where;
   last_fraction = first_fraction = first_second = 0.0;
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
   is_started = 1;
   set_timer(delay, milliseconds_between_lines);
}

/* Stop the timer and erase the line if one was written. */
void impactbeam_stop_progress(void)
{
   /* without a progress line, timer and signal belong to somebody else */
   if (!is_started) return;
   is_started = 0;
   set_timer(0, 0);
   signal(SIGALRM, SIG_IGN);
   if (!line_is_shown) return;
   static const char wipe[] = "\r\033[K";
   if (write(line_descriptor, wipe, sizeof wipe - 1) < 0) return;
   line_is_shown = 0;
}
