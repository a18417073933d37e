/* What the process has freed goes back to the system where the C library can do that: otherwise the next allocation takes its
 * place, and the size of the process does not show it. */
#ifdef __linux__
#include <features.h>
#endif
#ifdef __GLIBC__
#include <malloc.h>
#endif

void impactbeam_return_free_memory(void);

void impactbeam_return_free_memory(void)
{
#ifdef __GLIBC__
   (void)malloc_trim(0);
#endif
}
