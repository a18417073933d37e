/* A sweep has one thread for each core, and the matrices of a single run are small, so linear algebra must not start
 * threads. OpenBLAS starts threads before the main program begins, allocates a buffer for each, and repeats a failed
 * allocation without end. This file limits OpenBLAS to one thread and checks that its buffer can be allocated; other
 * libraries run one thread or follow the environment. */
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* Bytes that OpenBLAS allocates for each thread. */
static const size_t buffer_per_thread = (size_t)129 << 20;

int openblas_num_threads_env(void);
void openblas_set_num_threads(int threads) __attribute__((weak));

/* OpenBLAS calls this function for the value of OPENBLAS_NUM_THREADS. This definition takes precedence over the one
 * in OpenBLAS's shared library. The one in a static OpenBLAS would take precedence over this definition, so the linker
 * then replaces it (--wrap) by __wrap_openblas_num_threads_env. */
__attribute__((weak)) int openblas_num_threads_env(void)
{
   return 1;
}

int __wrap_openblas_num_threads_env(void);
int __wrap_openblas_num_threads_env(void)
{
   return 1;
}

/* Limits OpenBLAS to one thread even if it did not call the definitions above. */
void impactbeam_single_threaded_blas(void)
{
   if (openblas_set_num_threads) openblas_set_num_threads(1);
}

/* Address space in bytes that each thread takes permanently at its first call; little of it becomes memory. */
long long impactbeam_blas_buffer(void)
{
   return openblas_set_num_threads ? (long long)buffer_per_thread : 0;
}

#ifdef __ELF__
/* Ends the program with a message if the buffer of OpenBLAS cannot be allocated. Runs before any library starts. */
static void check_buffer_room(void)
{
   static const char message[] = "impactbeam: there is no room for the buffer of 129 MB of the linear algebra library; is "
                                 "the address space limited (ulimit -v)?\n";
   void *const room = mmap(NULL, buffer_per_thread, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
   if (room != MAP_FAILED) {
      munmap(room, buffer_per_thread);
   } else {
      if (openblas_set_num_threads && write(STDERR_FILENO, message, strlen(message)) >= 0) _exit(1);
   }
}

__attribute__((section(".preinit_array"), used)) static void (*const check)(void) = check_buffer_room;
#endif
