!> The program impactbeam-benchmark measures the run time and the error of all methods for a scene with &precision. Such
!> a study is called a precision study in the source.
program impactbeam_benchmark
   use, intrinsic :: iso_c_binding, only: c_int
   use precision_study, only: memory_need_of_precision, run_precision_scene
   use process, only: end_process
   use program_identity, only: program_benchmark
   use program_run, only: program_t, run_program
   implicit none (type, external)

   integer :: status

   call run_program(program_t(program_benchmark, 'Measures run time against error: scenes with &precision.', &
      memory_need_of_precision, run_precision_scene), status)
   if (status /= 0) call end_process(int(status, c_int))
end program impactbeam_benchmark
