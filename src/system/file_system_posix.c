/* File functions of POSIX that need C: errno, directory entries, mode bits. file_system.f90 has their Fortran interfaces.
 * Each function returns 0, or the errno of the call that failed, unless its comment says otherwise. */
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

/* Both are documented in process_posix.c. */
void impactbeam_note_unfinished(const char *path);
int impactbeam_write_all(int descriptor, const char *bytes, size_t count);

/* A code beside those of errno: the path does not name a regular file. */
enum { is_no_file = -1 };

/* Make a folder and its parents. A folder that exists is no error, a file in its place is. */
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
      } else if (mkdir(partial, 0777) != 0) {
         /* another process has just made the folder, or a link is dangling */
         code = errno == EEXIST && stat(partial, &status) == 0 ? 0 : errno;
      }
      *end = separator;
      if (separator == '\0') break;
   }
   free(partial);
   return code;
}

/* Make a folder that does not exist. */
int impactbeam_make_new_folder(const char *path)
{
   return mkdir(path, 0777) == 0 ? 0 : errno;
}

/* Kind of the entry that a path names: 0 nothing, 1 a file, 2 a folder, 3 a link, 4 something else or unknown. */
int impactbeam_kind_of(const char *path)
{
   struct stat status;
   if (lstat(path, &status) != 0) return errno == ENOENT ? 0 : 4;
   if (S_ISREG(status.st_mode)) return 1;
   if (S_ISDIR(status.st_mode)) return 2;
   return S_ISLNK(status.st_mode) ? 3 : 4;
}

/* Return the size of a file if `bytes` is NULL, else its bytes. Only regular files are read, because reading a pipe may
 * wait and a device has no end. */
int impactbeam_read_bytes(const char *path, int follow_links, char *bytes, size_t *count)
{
   struct stat status;
   const int file = open(path, O_RDONLY | O_NONBLOCK | (follow_links ? 0 : O_NOFOLLOW));
   if (file < 0) return errno;
   int code = fstat(file, &status) != 0 ? errno : S_ISREG(status.st_mode) ? 0 : is_no_file;
   if (code == 0 && bytes == NULL) *count = (size_t)status.st_size;
   size_t done = 0;
   while (code == 0 && bytes != NULL && done < *count) {
      const ssize_t got = read(file, bytes + done, *count - done);
      if (got > 0) done += (size_t)got;
      else if (got == 0) code = EIO;
      else if (errno != EINTR) code = errno;
   }
   close(file);
   return code;
}

/* Write a complete file. No other process writes a file of this name, so an existing file was left by a process that has
 * ended. The existing file is replaced instead of overwritten because it may have other hard links. */
int impactbeam_write_bytes(const char *path, const char *bytes, size_t count)
{
   impactbeam_note_unfinished(path);
   unlink(path);
   const int file = open(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, 0666);
   if (file < 0) return errno;
   const int code = impactbeam_write_all(file, bytes, count);
   return close(file) != 0 && code == 0 ? errno : code;
}

/* Rename a file and replace an existing file of the new name. */
int impactbeam_rename(const char *from, const char *to)
{
   return rename(from, to) == 0 ? 0 : errno;
}

/* Remove the files <folder>/<prefix><process> of processes that have ended. */
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

/* Open the list of entries of a folder that is not a link. NULL: the folder cannot be read. */
void *impactbeam_open_folder(const char *path)
{
   const int folder = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW);
   if (folder < 0) return NULL;
   DIR *const entries = fdopendir(folder);
   if (entries == NULL) close(folder);
   return entries;
}

/* Get the name of the next entry, truncated to `size`. Returns 0 if there are no more entries, else 1. */
int impactbeam_next_entry(void *entries, char *name, size_t size)
{
   const struct dirent *entry;
   do {
      entry = readdir(entries);
      if (entry == NULL) return 0;
   } while (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0);
   snprintf(name, size, "%s", entry->d_name);
   return 1;
}

/* Remove a file of the folder. Subfolders remain. */
void impactbeam_remove_entry(void *entries, const char *name)
{
   unlinkat(dirfd((DIR *)entries), name, 0);
}

void impactbeam_close_folder(void *entries)
{
   closedir(entries);
}

/* Remove a folder that is empty. */
int impactbeam_remove_empty_folder(const char *path)
{
   return rmdir(path) == 0 ? 0 : errno;
}

/* Description of an errno or of is_no_file, truncated to `size`. */
void impactbeam_describe(int code, char *text, size_t size)
{
   snprintf(text, size, "%s", code == is_no_file ? "not a regular file but a folder, a pipe or a device" : strerror(code));
}
