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

/* No errno: what has the name is not a regular file. */
enum { is_no_file = -1 };

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
      } else if (mkdir(partial, 0777) != 0) {
         /* another process made it just now, or a link leads nowhere */
         code = errno == EEXIST && stat(partial, &status) == 0 ? 0 : errno;
      }
      *end = separator;
      if (separator == '\0') break;
   }
   free(partial);
   return code;
}

/* Make a folder that is not there. */
int impactbeam_make_new_folder(const char *path)
{
   return mkdir(path, 0777) == 0 ? 0 : errno;
}

/* What has this name: 0 nothing, 1 a file, 2 a folder, 3 a link, 4 something else; where that cannot be known, 4. */
int impactbeam_kind_of(const char *path)
{
   struct stat status;
   if (lstat(path, &status) != 0) return errno == ENOENT ? 0 : 4;
   if (S_ISREG(status.st_mode)) return 1;
   if (S_ISDIR(status.st_mode)) return 2;
   return S_ISLNK(status.st_mode) ? 3 : 4;
}

/* The size of a file, and its bytes. Only a regular file is read: a pipe would be waited for, a device has no end. */
int impactbeam_read_bytes(const char *path, int follows_links, char *bytes, size_t *count)
{
   struct stat status;
   const int file = open(path, O_RDONLY | O_NONBLOCK | (follows_links ? 0 : O_NOFOLLOW));
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

/* Write a file whole under its name. Nobody else writes under this name: what has it was left by a process that is
 * gone, and it is replaced rather than written into, since it may have other names. */
int impactbeam_write_bytes(const char *path, const char *bytes, size_t count)
{
   impactbeam_note_unfinished(path);
   unlink(path);
   const int file = open(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, 0666);
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

/* The entries of a folder that is no link. NULL: it cannot be read. */
void *impactbeam_open_folder(const char *path)
{
   const int folder = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW);
   if (folder < 0) return NULL;
   DIR *const entries = fdopendir(folder);
   if (entries == NULL) close(folder);
   return entries;
}

/* The name of the next entry; 0: there are no more. A name that is too long is cut. */
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

/* Remove a file of the folder; a folder in it stays. */
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

/* The words for an errno or for is_no_file, cut to fit. */
void impactbeam_describe(int code, char *text, size_t size)
{
   snprintf(text, size, "%s", code == is_no_file ? "not a regular file but a folder, a pipe or a device" : strerror(code));
}
