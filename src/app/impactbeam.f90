!> The program impactbeam computes responses and frequencies of a beam with stops, cases and sweeps.
program impactbeam
   use, intrinsic :: iso_c_binding, only: c_int
   use process, only: end_process
   use program_identity, only: program_motion
   use program_run, only: program_t, run_program
   use scene_needs, only: memory_need_of_scene
   use scene_run, only: run_motion_scene
   implicit none (type, external)

   character, parameter :: line_end = new_line('a')
   integer :: status

   call run_program(program_t(program_motion, &
      'Computes how a beam strikes stops, rebounds, chatters and comes to rest.', &
      memory_need_of_scene, run_motion_scene, &
      '  impactbeam --new beam > my.nml'//line_end// &
      '  impactbeam my.nml'//line_end// &
      '  impactbeam-plot response results/my.h5'//line_end), status)
   if (status /= 0) call end_process(int(status, c_int))
end program impactbeam
