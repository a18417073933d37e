!> impactbeam: responses and frequencies, cases, sweeps.
program impactbeam
   use program_identity, only: program_motion
   use program_run, only: program_t, run_program
   use scene_needs, only: needs_of_scene
   use scene_run, only: run_motion_scene
   implicit none (type, external)

   integer :: status

   call run_program(program_t(program_motion, &
      'Computes how a clamped beam hits a stop, rebounds, chatters and comes to rest.', &
      needs_of_scene, run_motion_scene), status)
   if (status /= 0) stop status, quiet=.true.
end program impactbeam
