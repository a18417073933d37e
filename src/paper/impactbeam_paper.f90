!> The program impactbeam-paper judges the statements of the paper.
program impactbeam_paper
   use, intrinsic :: iso_c_binding, only: c_int
   use paper_run, only: memory_need_of_statements, run_statements
   use process, only: end_process
   use program_identity, only: program_paper
   use program_run, only: program_t, run_program
   implicit none (type, external)

   integer :: status

   call run_program(program_t(program_paper, 'Tests the statements of the paper of 1977: scenes with &statements.', &
      memory_need_of_statements, run_statements), status)
   if (status /= 0) call end_process(int(status, c_int))
end program impactbeam_paper
