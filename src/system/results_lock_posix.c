/* A lock that its owner loses by ending, however it ends, and that says who has it.
 * Fortran's side is results_claim.f90. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

/* Explained in process_posix.c. */
void impactbeam_note_lock(const char *path);

/* What a file of locks begins with. */
static const char ours[] = "impactbeam ";
enum { is_held = -1, is_foreign = -2, longest_owner = 300 };

static int has_no_locks(int code)
{
   return code == ENOLCK || code == ENOSYS || code == EINVAL || code == EOPNOTSUPP || code == ENOTSUP;
}

/* Lock the open file and write into it whose it is. */
static int take(int file, const char *path, char *owner, size_t size)
{
   struct stat here, there;
   struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
   char content[longest_owner];
   int code;

   if (fstat(file, &here) != 0) return errno;
   if (!S_ISREG(here.st_mode)) return is_foreign;
   code = fcntl(file, F_SETLK, &lock) == 0 ? 0 : errno;
   ssize_t length = pread(file, content, sizeof content - 1, 0);
   /* who has it may be about to say so */
   const struct timespec moment = {.tv_nsec = 10000000};
   for (int look = 0; look < 50 && length == 0 && (code == EACCES || code == EAGAIN); ++look) {
      nanosleep(&moment, NULL);
      length = pread(file, content, sizeof content - 1, 0);
   }
   if (length < 0) return errno;
   content[length] = '\0';
   content[strcspn(content, "\n")] = '\0';
   if (length > 0 && strncmp(content, ours, strlen(ours)) != 0) return is_foreign;
   if (code == EACCES || code == EAGAIN) {
      snprintf(owner, size, "%s", length > 0 ? content + strlen(ours) : "another process");
      return is_held;
   }
   /* a disk without locks has them for nobody: better a run without than none */
   if (code != 0 && !has_no_locks(code)) return code;
   /* the owner before may have removed the file in between */
   if (lstat(path, &there) != 0 || there.st_ino != here.st_ino || there.st_dev != here.st_dev) return EAGAIN;
   char host[256] = "";
   gethostname(host, sizeof host - 1);
   const int room = snprintf(content, sizeof content, "%sprocess %ld on %s\n", ours, (long)getpid(), host);
   if (ftruncate(file, 0) != 0 || pwrite(file, content, (size_t)room, 0) != room) return errno != 0 ? errno : EIO;
   return 0;
}

/* Lock by the file of that name, which is made where it is not there. 0: `file` is to be given back to
 * impactbeam_unlock; -1: `owner` says who has it; -2: the file is none of ours; else the errno. */
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

/* Remove the file while it is locked, then give up the lock. */
void impactbeam_unlock(const char *path, int file)
{
   unlink(path);
   impactbeam_note_lock("");
   close(file);
}
