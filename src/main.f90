!> impactbeam: the command line in, the exit status out; the work is `run_command_line`'s.
program impactbeam
   use program_run, only: run_command_line
   implicit none (type, external)

   integer :: status

   call run_command_line(status)
   if (status /= 0) stop status, quiet=.true.
end program impactbeam
