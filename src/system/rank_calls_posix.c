/* Loading MPI takes longer than a short run, so the calls of MPI (rank_calls_mpi.c) are a separate library, which is loaded
 * only if MPI's launcher has started this process. rank_calls.f90 has the Fortran interfaces. */
#include <dlfcn.h>
#include <stddef.h>
#include <stdio.h>

static void *library;

/* Load the library. Returns 1 if loaded, 0 if not (`why` is the reason), -1 if the program was built without MPI. */
int impactbeam_load_rank_calls(char *why, size_t size)
{
#ifdef IMPACTBEAM_MPI
   /* RTLD_GLOBAL because the plug-ins of MPI need the symbols of MPI */
   library = dlopen("impactbeam_ranks.so", RTLD_NOW | RTLD_GLOBAL);
   if (library) return 1;
   const char *const words = dlerror();
   snprintf(why, size, "%s", words ? words : "");
   return 0;
#else
   (void)why, (void)size;
   return -1;
#endif
}

/* Address of a function in the loaded library. */
int (*impactbeam_rank_call(const char *name))(int)
{
   int (*call)(int) = NULL;
   *(void **)&call = dlsym(library, name);
   return call;
}
