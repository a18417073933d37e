/* A sweep has a thread for each core, and the matrices of a single run are small: linear algebra must not start threads of
 * its own. OpenBLAS starts them, and gives each a buffer, before the main program begins, and asks for a buffer over and
 * over where there is no room for it. What follows keeps it to one thread and to no more than there is room for; other
 * libraries run one thread, or know the environment. */
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static const size_t buffer_of_a_thread = (size_t)129 << 20;

int openblas_num_threads_env(void);
void openblas_set_num_threads(int threads) __attribute__((weak));

/* What OpenBLAS takes for the value of OPENBLAS_NUM_THREADS: this one goes before that of its shared library; that of its
 * archive would go before this one, so there the linker is told to take the second (--wrap). */
__attribute__((weak)) int openblas_num_threads_env(void)
{
   return 1;
}

int __wrap_openblas_num_threads_env(void);
int __wrap_openblas_num_threads_env(void)
{
   return 1;
}

/* The same where its own goes before this one. */
void impactbeam_single_threaded_blas(void)
{
   if (openblas_set_num_threads) openblas_set_num_threads(1);
}

/* Address space that each thread takes for good at its first call, little of it as memory. */
long long impactbeam_blas_buffer(void)
{
   return openblas_set_num_threads ? (long long)buffer_of_a_thread : 0;
}

#ifdef __ELF__
/* Before any library begins. */
static void look_for_room(void)
{
   static const char message[] = "impactbeam: there is no room for the buffer of 129 MB of the linear algebra library; is "
                                 "the address space limited (ulimit -v)?\n";
   void *const room = mmap(NULL, buffer_of_a_thread, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
   if (room != MAP_FAILED) {
      munmap(room, buffer_of_a_thread);
   } else {
      if (openblas_set_num_threads && write(STDERR_FILENO, message, strlen(message)) >= 0) _exit(1);
   }
}

__attribute__((section(".preinit_array"), used)) static void (*const first)(void) = look_for_room;
#endif
