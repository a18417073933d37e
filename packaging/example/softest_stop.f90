!> Which of several restitutions leaves the beam quiet first? One scene each, run from code; the answers are in the
!> results files.
program softest_stop
   use impactbeam_library, only: run_scene_file
   implicit none (type, external)

   real, parameter :: restitutions(3) = [0.2, 0.5, 0.8]
   character(:), allocatable :: results, message
   character(32) :: name
   integer :: i, status, unit

   do i = 1, size(restitutions)
      write (name, '(a, i0, a)') 'stop_', nint(10*restitutions(i)), '.nml'
      open (newunit=unit, file=name, action='write', status='replace')
      write (unit, '(a, f4.1, a)') '&stop restitution =', restitutions(i), ', preload = 0.1 /'
      write (unit, '(a)') '&damping zeta = 0.01 /', '&response duration = 20 /'
      close (unit)
      call run_scene_file(trim(name), 'results', results, status, message)
      if (status /= 0) then
         print '(a)', message
         error stop 1
      end if
      print '(a)', results
   end do
end program softest_stop
