/* A lock on a file, which the system releases when the process that has the lock (its owner) ends, however the process
 * ends. The file names its owner.
 * results_claim.f90 has the Fortran interfaces. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

/* Both are documented in process_posix.c. */
void impactbeam_note_lock(const char *path);
int impactbeam_write_all(int descriptor, const char *bytes, size_t count);

/* First characters of a lock file of this program. */
static const char lock_mark[] = "impactbeam ";
enum { is_locked = -1, is_foreign = -2, longest_owner = 300 };

/* Whether the errno means that the disk has no locks. */
static int has_no_locks(int code)
{
   return code == ENOLCK || code == ENOSYS || code == EINVAL || code == EOPNOTSUPP || code == ENOTSUP;
}

/* Lock the open file and write a text that names this process into it. Returns as impactbeam_lock does, or EAGAIN if
 * the file has been removed or replaced since it was opened. */
static int take(int file, const char *path, char *owner, size_t size)
{
   struct stat opened, named;
   struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
   char content[longest_owner];
   int code;

   if (fstat(file, &opened) != 0) return errno;
   if (!S_ISREG(opened.st_mode)) return is_foreign;
   code = fcntl(file, F_SETLK, &lock) == 0 ? 0 : errno;
   ssize_t length = pread(file, content, sizeof content - 1, 0);
   /* the owner may not have written its name yet */
   const struct timespec interval = {.tv_nsec = 10000000};
   for (int attempt = 0; attempt < 50 && length == 0 && (code == EACCES || code == EAGAIN); ++attempt) {
      nanosleep(&interval, NULL);
      length = pread(file, content, sizeof content - 1, 0);
   }
   if (length < 0) return errno;
   content[length] = '\0';
   content[strcspn(content, "\n")] = '\0';
   if (length > 0 && strncmp(content, lock_mark, strlen(lock_mark)) != 0) return is_foreign;
   if (code == EACCES || code == EAGAIN) {
      snprintf(owner, size, "%s", length > 0 ? content + strlen(lock_mark) : "another process");
      return is_locked;
   }
   /* on a disk without locks no process can lock, so the run goes on without a lock */
   if (code != 0 && !has_no_locks(code)) return code;
   /* the previous owner may have removed the file since it was opened */
   if (lstat(path, &named) != 0 || named.st_ino != opened.st_ino || named.st_dev != opened.st_dev) return EAGAIN;
   char host[256] = "";
   gethostname(host, sizeof host - 1);
   const int room = snprintf(content, sizeof content, "%sprocess %ld on %s\n", lock_mark, (long)getpid(), host);
   code = ftruncate(file, 0) == 0 ? impactbeam_write_all(file, content, (size_t)room) : errno;
   /* as on a full disk */
   if (code != 0) unlink(path);
   return code;
}

/* Lock by means of a file, which is made if it does not exist. Returns 0 if locked (`file` is to be passed to
 * impactbeam_unlock); -1 if another process has the lock (`owner` names it); -2 if the file is not a lock of this program;
 * else the errno. */
int impactbeam_lock(const char *path, int *file, char *owner, size_t size)
{
   int code;
   do {
      *file = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
      if (*file < 0) return errno == ELOOP || errno == EISDIR || errno == ENXIO ? is_foreign : errno;
      code = take(*file, path, owner, size);
      if (code != 0) close(*file);
   } while (code == EAGAIN);
   if (code == 0) impactbeam_note_lock(path);
   return code;
}

/* Remove the file while it is locked, then release the lock. */
void impactbeam_unlock(const char *path, int file)
{
   unlink(path);
   impactbeam_note_lock("");
   close(file);
}
