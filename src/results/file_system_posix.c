/* What POSIX gives to C alone: errno, directory entries, mode bits. Fortran's side is file_system.f90.
 * Each function returns 0, or the errno of the call that failed. */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

/* Both in process_posix.c. */
void impactbeam_note_unfinished(const char *path);
int impactbeam_write_all(int descriptor, const char *bytes, size_t count);

/* Make a folder and those above it; one that is there already is no error, a file in its place is. */
int impactbeam_make_folder(const char *path)
{
   char *partial = strdup(path);
   int code = 0;
   if (partial == NULL) return ENOMEM;
   for (char *end = partial + 1; code == 0; ++end) {
      if (*end != '/' && *end != '\0') continue;
      const char separator = *end;
      *end = '\0';
      struct stat status;
      if (stat(partial, &status) == 0) {
         if (!S_ISDIR(status.st_mode)) code = ENOTDIR;
      } else if (mkdir(partial, 0777) != 0 && errno != EEXIST) {
         code = errno;
      }
      *end = separator;
      if (separator == '\0') break;
   }
   free(partial);
   return code;
}

/* Write a file whole under its name, which must not be that of a link; a file of that name is emptied first. */
int impactbeam_write_bytes(const char *path, const char *bytes, size_t count)
{
   impactbeam_note_unfinished(path);
   const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW, 0666);
   if (file < 0) return errno;
   /* Past a limit on the size of files write() shall fail, not end the program. */
   void (*const former)(int) = signal(SIGXFSZ, SIG_IGN);
   int code = impactbeam_write_all(file, bytes, count);
   if (close(file) != 0 && code == 0) code = errno;
   if (former != SIG_ERR) signal(SIGXFSZ, former);
   return code;
}

/* Give a file another name, in place of the file that has it. */
int impactbeam_rename(const char *from, const char *to)
{
   return rename(from, to) == 0 ? 0 : errno;
}

/* Remove the files <folder>/<prefix><process> of processes that are gone. */
void impactbeam_remove_leftovers(const char *folder, const char *prefix)
{
   const size_t length = strlen(prefix);
   DIR *const entries = opendir(folder);
   if (entries == NULL) return;
   for (const struct dirent *entry = readdir(entries); entry != NULL; entry = readdir(entries)) {
      if (strncmp(entry->d_name, prefix, length) != 0) continue;
      char *end;
      const long process = strtol(entry->d_name + length, &end, 10);
      if (process <= 0 || *end != '\0') continue;
      if (kill((pid_t)process, 0) != 0 && errno == ESRCH) unlinkat(dirfd(entries), entry->d_name, 0);
   }
   closedir(entries);
}

/* Remove a folder and the files in it; where one cannot be removed the folder stays. */
void impactbeam_remove_folder(const char *path)
{
   DIR *const entries = opendir(path);
   if (entries == NULL) return;
   for (const struct dirent *entry = readdir(entries); entry != NULL; entry = readdir(entries)) {
      if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0) continue;
      unlinkat(dirfd(entries), entry->d_name, 0);
   }
   closedir(entries);
   rmdir(path);
}

/* The words for an errno, cut to fit. */
void impactbeam_describe(int code, char *text, size_t size)
{
   snprintf(text, size, "%s", strerror(code));
}
