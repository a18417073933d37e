!> Prints the tables of a precision study (run time against error of all methods).
module precision_tables
   use, intrinsic :: iso_fortran_env, only: compiler_version
   use kinds, only: wp
   use number_text, only: to_text
   use precision_types, only: fastest_of, error_bounds, error_contributions, scheme_name, schemes_of, motion_entry_t, &
      precision_t, varied_hop, varied_mesh, varied_modes, varied_names, varied_step
   use scene_types, only: integrator_exact, integrator_names, mass_names, scene_t
   use solver_precision, only: rounding_start
   use timed_tasks, only: kind_of_build, processor_name
   implicit none (type, external)
   private
   public :: print_precision

contains

   !> Print all tables of the study.
   subroutine print_precision(unit, scene, study)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(precision_t), intent(in) :: study

      write (unit, '(a)') scene%name//': '//scene%title
      write (unit, '(2x, a)') processor_name()//', '//compiler_version()//', '//kind_of_build()
      if (allocated(study%runs)) call print_motion(unit, study)
      if (allocated(study%beam)) call print_fastest(unit, study)
      if (allocated(study%parts)) call print_parts(unit, study)
      if (allocated(study%curves)) call print_curves(unit, study)
      if (allocated(study%savings)) call print_savings(unit, study)
      if (allocated(study%solvers)) call print_solvers(unit, study)
   end subroutine print_precision

   !> Print run time and error of motion.
   subroutine print_motion(unit, study)
      integer, intent(in) :: unit
      type(precision_t), intent(in) :: study

      character(*), parameter :: numbers = '(2x, a22, a16, es10.1, 6es10.1, es11.2, a)'
      character(40) :: name
      integer :: i

      write (unit, '(/, 2x, a22, a16, 7a10, a11, a)') adjustl('method                '), 'varied', 'value', 'tau_1', &
         'v_1', 'history', 'energy', 'impulse', 'balance', 'seconds', '  quartiles'
      do i = 1, size(study%runs)
         associate (entry => study%runs(i), errors => study%runs(i)%errors)
            if (allocated(study%beam) .and. entry%varied == varied_mesh .and. &
               entry%integrator /= integrator_exact) cycle
            if (entry%failure /= '') then
               write (unit, '(2x, a22, a16, es10.1, 2x, a)') integrator_names(entry%integrator), &
                  varied_names(entry%varied), value_of(entry), trim(entry%failure)
               cycle
            end if
            name = integrator_names(entry%integrator)(:len(name))
            if (allocated(study%beam) .and. entry%varied == varied_mesh) name = scheme_name(entry)
            write (unit, numbers) name(:22), adjustr(varied_names(entry%varied)(:16)), &
               value_of(entry), errors%impact_tau, errors%impact_velocity, errors%history, errors%energy, &
               errors%impulse, errors%energy_balance, entry%run_time%median, &
               '  '//short(entry%run_time%lower_quartile)//' ... '//short(entry%run_time%upper_quartile)
         end associate
      end do
      write (unit, '(2x, a, f0.3)') 'differences from the reference, up to tau = ', study%horizon
      write (unit, '(2x, a)') 'reference: exact motion of the model in all its modes, with a hop tolerance of 1e-14'
      associate (check => study%check)
         if (check%failure /= '') then
            write (unit, '(2x, a)') 'the check of the reference failed: '//trim(check%failure)
         else
            write (unit, '(2x, a, es8.1)') 'check of the reference by average_acceleration, extrapolated from two '// &
               'steps, of which the longer is', check%steps(1)
            associate (of_longer_step => check%longer_step_difference)
               write (unit, '(2x, a48, 5es10.1)') 'difference of longer step and extrapolation', &
                  of_longer_step%impact_tau, of_longer_step%impact_velocity, of_longer_step%history, &
                  of_longer_step%energy, of_longer_step%impulse
            end associate
            write (unit, '(2x, a48, 5es10.1)') 'difference of extrapolation and reference', &
               check%difference%impact_tau, check%difference%impact_velocity, check%difference%history, &
               check%difference%energy, check%difference%impulse
         end if
      end associate
   end subroutine print_motion

   !> Print the fastest run of each scheme within each error bound, and the contributions of step and mesh to the error
   !> of Newmark's method on the scene's mesh.
   subroutine print_fastest(unit, study)
      !> Unit of the output
      integer, intent(in) :: unit
      !> Results of the study
      type(precision_t), intent(in) :: study

      integer :: i, k

      associate (entries => study%runs, beam => study%beam, schemes => schemes_of(study%runs))
         write (unit, '(/, 2x, a, f0.3, a)') 'fastest run with an error of eta (difference from the fine mesh) below ' &
            //'each bound, up to tau = ', study%horizon, ': time in ms, elements, step'
         ! one column for each scheme, by the first entry of the scheme
         write (unit, '(2x, a8, *(a36))') 'bound', (trim(scheme_name(entries(schemes(k)))), k=1, size(schemes))
         do i = 1, size(error_bounds)
            write (unit, '(2x, es8.0, *(a36))') error_bounds(i), &
               (cell(fastest_of(entries, entries(schemes(k)), error_bounds(i))), k=1, size(schemes))
         end do
         write (unit, '(2x, a, i0, a, es8.1)') 'fine mesh: exact motion, '//trim(mass_names(beam%mass))//', ', &
            beam%elements, ' elements; with half as many elements eta differs by', beam%half_mesh_difference%history
         write (unit, '(2x, a, es8.1)') 'error of eta on the fine mesh, estimated for convergence of order four:', &
            beam%uncertainty
         if (beam%other_mass_failure /= '') then
            write (unit, '(2x, a)') 'the run with the other mass matrix failed: '//trim(beam%other_mass_failure)
         else
            write (unit, '(2x, a, es8.1)') 'with the other mass matrix (extrapolated if of order one) eta differs by', &
               beam%other_mass_difference%history
         end if
         write (unit, '(/, 2x, a22, 4a12)') 'error of eta          ', 'step', 'by step', 'by mesh', 'by both'
         do i = 1, size(entries)
            if (entries(i)%varied == varied_step) write (unit, '(2x, a22, 4es12.1)') &
               integrator_names(entries(i)%integrator), entries(i)%step, error_contributions(entries, i)
         end do
      end associate

   contains

      !> Short text of an entry (time in ms, elements, step); a dash if there is none.
      function cell(number) result(text)
         integer, intent(in) :: number
         character(36) :: text

         text = '-'
         if (number > 0) then
            associate (entry => study%runs(number))
               write (text, '(es8.2, i6)') 1.0e3_wp*entry%run_time%median, entry%elements
               if (entry%integrator /= integrator_exact) write (text(15:), '(es9.1)') entry%step
            end associate
         end if
         text = adjustr(text)
      end function cell

   end subroutine print_fastest

   !> Value of the setting that an entry varies.
   pure real(wp) function value_of(entry) result(value)
      type(motion_entry_t), intent(in) :: entry

      select case (entry%varied)
      case (varied_hop)
         value = entry%hop_tolerance
      case (varied_modes)
         value = entry%mode_tolerance
      case (varied_mesh)
         value = real(entry%elements, wp)
      case default
         value = entry%step
      end select
   end function value_of

   !> Text of a number with three significant digits.
   function short(value) result(text)
      real(wp), intent(in) :: value
      character(8) :: text

      write (text, '(es8.2)') value
   end function short

   !> Print the times of the parts of a run.
   subroutine print_parts(unit, study)
      integer, intent(in) :: unit
      type(precision_t), intent(in) :: study

      integer :: i

      write (unit, '(/, 2x, a32, a11, a)') adjustl('part of a run by exact motion   '), 'seconds', '  quartiles'
      do i = 1, size(study%parts)
         associate (timing => study%parts(i)%timing)
            write (unit, '(2x, a32, es11.2, a)') study%parts(i)%name(:32), timing%median, &
               '  '//short(timing%lower_quartile)//' ... '//short(timing%upper_quartile)
         end associate
      end do
   end subroutine print_parts

   !> Print the run times with and without each computation that is omitted if a scene does not need it.
   subroutine print_savings(unit, study)
      integer, intent(in) :: unit
      type(precision_t), intent(in) :: study

      integer :: i

      write (unit, '(/, 2x, a32, 2a11, a8, a12, a)') adjustl('omitted computation             '), 'computed, s', &
         'omitted, s', 'saved', 'difference', '  of'
      do i = 1, size(study%savings)
         associate (saving => study%savings(i))
            write (unit, '(2x, a32, 2es11.2, i6, a)', advance='no') saving%name(:32), saving%without%median, &
               saving%with%median, nint(100.0_wp*(1.0_wp - saving%with%median/saving%without%median)), ' %'
            if (saving%difference < 0.0_wp) then
               write (unit, '(a12)', advance='no') '-'
            else
               write (unit, '(es12.1)', advance='no') saving%difference
            end if
            write (unit, '(a)') '  '//trim(saving%compared)
         end associate
      end do
   end subroutine print_savings

   !> Print how run times and numbers of events grow, as exponents of power laws.
   subroutine print_curves(unit, study)
      integer, intent(in) :: unit
      type(precision_t), intent(in) :: study

      integer :: i, last

      if (size(study%curves) == 0) return
      write (unit, '(/, 2x, a40, a12, a10, a)') adjustl('growth as a power                       '), 'of', &
         'exponent', '  from ... to'
      do i = 1, size(study%curves)
         associate (curve => study%curves(i))
            last = size(curve%abscissa)
            if (last == 0) cycle
            write (unit, '(2x, a40, a12, f10.2, a)') curve%name(:40), adjustr(curve%abscissa_name(:12)), &
               curve%exponent, &
               '  '//short(curve%ordinate(1))//' at '//to_text(curve%abscissa(1))//' ... '// &
               short(curve%ordinate(last))//' at '//to_text(curve%abscissa(last))//', '//trim(curve%unit)
         end associate
      end do
   end subroutine print_curves

   !> Print run time and error of the frequency solvers, and the mesh beyond which rounding errors dominate.
   subroutine print_solvers(unit, study)
      integer, intent(in) :: unit
      type(precision_t), intent(in) :: study

      character(*), parameter :: rounding = '  rounding errors dominate on finer meshes'
      integer :: i, rounding_mesh

      write (unit, '(/, 2x, a12, a10, a8, 2a12, a11)') adjustl('solver      '), 'elements', 'ratio', 'lambda_1', &
         'largest', 'seconds'
      do i = 1, size(study%solvers)
         associate (entry => study%solvers(i))
            write (unit, '(2x, a12, i10, f8.2, 2es12.1, es11.2)', advance='no') entry%solver(:12), entry%elements, &
               entry%ratio, entry%first_error, entry%largest_error, entry%timing%median
            rounding_mesh = rounding_start(study%solvers, trim(entry%solver), entry%ratio)
            if (rounding_mesh == entry%elements) write (unit, '(a)', advance='no') rounding
            write (unit, '()')
         end associate
      end do
      write (unit, '(2x, a)') 'relative errors of lambda; -1: no exact value is known, or the solver found none'
   end subroutine print_solvers

end module precision_tables
