/* To load MPI takes longer than a short run, so what calls it (rank_calls_mpi.c) is a library of its own, loaded where MPI's
 * launcher has started this process. Fortran's side is rank_calls.f90. */
#include <dlfcn.h>
#include <stddef.h>
#include <stdio.h>

static void *library;

/* 1: loaded; 0: not, for that reason; -1: the program was built without MPI. */
int impactbeam_load_rank_calls(char *why, size_t size)
{
#ifdef IMPACTBEAM_MPI
   /* its own plug-ins look for its names */
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

/* A call of the library that was loaded. */
int (*impactbeam_rank_call(const char *name))(int)
{
   int (*call)(int) = NULL;
   *(void **)&call = dlsym(library, name);
   return call;
}
