/* Memory that this process can still allocate. process.f90 has the Fortran interfaces. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>

enum { longest_line = 1024, longest_path = 2048 };

/* Read the number behind `word` at the start of a line of a file, or the only number of a file if `word` is empty.
 * The result is negative if there is no such number. */
static double number_in(const char *path, const char *word)
{
   char line[longest_line];
   double number = -1.0, found;
   FILE *const file = fopen(path, "r");
   if (file == NULL) return number;
   while (number < 0.0 && fgets(line, sizeof line, file) != NULL) {
      if (strncmp(line, word, strlen(word)) == 0 && sscanf(line + strlen(word), "%lf", &found) == 1) number = found;
   }
   fclose(file);
   return number;
}

/* Free memory within the limits of a control group and its parents. Cached pages of inactive files count as free.
 * `limit`, `usage` and `cached` name the files and the entry with the maximum, the used bytes and the cached bytes;
 * `group` is shortened. */
static double free_in_group(const char *root, char *group, const char *limit, const char *usage, const char *cached)
{
   char folder[longest_path], path[longest_path + 64];
   double free_bytes = HUGE_VAL;
   for (;;) {
      snprintf(folder, sizeof folder, "%s%s", root, group);
      snprintf(path, sizeof path, "%s/%s", folder, limit);
      const double maximum = number_in(path, "");
      snprintf(path, sizeof path, "%s/%s", folder, usage);
      const double used = number_in(path, "");
      snprintf(path, sizeof path, "%s/memory.stat", folder);
      const double files = number_in(path, cached);
      if (maximum >= 0.0 && used >= 0.0) free_bytes = fmin(free_bytes, fmax(maximum - used + fmax(files, 0.0), 0.0));
      char *const end = strrchr(group, '/');
      if (end == NULL) return free_bytes;
      *end = '\0';
   }
}

/* Free bytes of memory and swap of this process, as Linux reports them; infinite if unknown. */
double impactbeam_free_memory(void)
{
   const double kilobyte = 1024.0;
   const double available = number_in("/proc/meminfo", "MemAvailable:"), swap = number_in("/proc/meminfo", "SwapFree:");
   double free_bytes = HUGE_VAL;
   if (available >= 0.0) free_bytes = kilobyte*(available + fmax(swap, 0.0));
   char line[longest_line];
   FILE *const groups = fopen("/proc/self/cgroup", "r");
   if (groups == NULL) return free_bytes;
   while (fgets(line, sizeof line, groups) != NULL) {
      line[strcspn(line, "\n")] = '\0';
      char *const names = strchr(line, ':'), *const group = names == NULL ? NULL : strchr(names + 1, ':');
      if (group == NULL) continue;
      *group = '\0';
      if (names[1] == '\0') {
         free_bytes = fmin(free_bytes, free_in_group("/sys/fs/cgroup", group + 1, "memory.max", "memory.current",
                                                     "inactive_file "));
      } else if (strcmp(names + 1, "memory") == 0) {
         free_bytes = fmin(free_bytes, free_in_group("/sys/fs/cgroup/memory", group + 1, "memory.limit_in_bytes",
                                                     "memory.usage_in_bytes", "total_inactive_file "));
      }
   }
   fclose(groups);
   return free_bytes;
}

/* Free bytes of a limited address space (ulimit -v), found by bisection with trial mappings; infinite if unlimited. */
double impactbeam_free_addresses(void)
{
   struct rlimit limit;
   if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return HUGE_VAL;
   const size_t page = 65536;
   size_t fits = 0, too_many = (size_t)limit.rlim_cur/page + 1;
   while (too_many - fits > 1) {
      const size_t pages = fits + (too_many - fits)/2;
      void *const mapping = mmap(NULL, pages*page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (mapping == MAP_FAILED) {
         too_many = pages;
      } else {
         munmap(mapping, pages*page);
         fits = pages;
      }
   }
   return (double)fits*(double)page;
}
