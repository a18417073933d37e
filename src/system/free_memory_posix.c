/* Return freed memory to the operating system if the C library can. Otherwise the next allocation reuses the freed memory
 * and the size of the process does not show the allocation. */
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
