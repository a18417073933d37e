/* The sweep has a thread for each core; linear algebra inside a case must not start threads of its own. OpenBLAS is told
 * so where it is what the program was linked with; other libraries run one thread, or know the environment. */

void openblas_set_num_threads(int threads) __attribute__((weak));

void impactbeam_single_threaded_blas(void)
{
   if (openblas_set_num_threads) openblas_set_num_threads(1);
}
