!> impactbeam: the command line in, the exit status out; the work is `run_program`'s.
program impactbeam
   use program_run, only: run_program
   implicit none (type, external)

   integer :: status

   call run_program(status)
   if (status /= 0) stop status, quiet=.true.
end program impactbeam
