!> Prints the tables of a precision study (run time against error of all methods).
module precision_tables
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: compiler_version
   use kinds, only: wp
   use motion_errors, only: motion_errors_t
   use number_text, only: rounded, to_text
   use precision_types, only: check_t, curve_t, fastest_of, error_bounds, error_contributions, scheme_name, &
      schemes_of, motion_entry_t, precision_t, saving_t, solver_entry_t, timed_part_t, varied_hop, varied_mesh, &
      varied_modes, varied_names, varied_step
   use reader_units, only: with_decimals
   use scene_types, only: integrator_exact, integrator_names, mass_names, scene_t
   use solver_precision, only: rounding_start
   use table_columns, only: add_numbers, add_texts, print_line, print_table, print_title, six_digits, table_t, &
      two_digits, whole, with_two_digits
   use timed_tasks, only: kind_of_build, processor_name, timing_t
   implicit none (type, external)
   private
   public :: print_precision

   !> Factor from seconds to milliseconds.
   real(wp), parameter :: milliseconds = 1.0e3_wp

contains

   !> Print all tables of the study.
   subroutine print_precision(unit, scene, study)
      integer, intent(in) :: unit
      type(scene_t), intent(in) :: scene
      type(precision_t), intent(in) :: study

      call print_title(unit, scene%name, scene%title)
      call print_line(unit, '', processor_name()//', '//compiler_version()//', '//kind_of_build(), width=0)
      if (allocated(study%runs)) call print_motion(unit, study)
      if (allocated(study%beam)) call print_fastest(unit, study)
      if (allocated(study%parts)) call print_parts(unit, study%parts)
      if (allocated(study%curves)) call print_curves(unit, study%curves)
      if (allocated(study%savings)) call print_savings(unit, study%savings)
      if (allocated(study%solvers)) call print_solvers(unit, study%solvers)
   end subroutine print_precision

   !> Print run time and error of motion, a table for each method and setting that is varied.
   subroutine print_motion(unit, study)
      integer, intent(in) :: unit
      type(precision_t), intent(in) :: study

      character(64), allocatable :: names(:)
      logical, allocatable :: is_shown(:)
      integer :: i

      associate (entries => study%runs)
         allocate (names(size(entries)))
         is_shown = entries%varied /= varied_mesh .or. entries%integrator == integrator_exact .or. &
            .not. allocated(study%beam)
         do i = 1, size(entries)
            names(i) = integrator_names(entries(i)%integrator)
            if (allocated(study%beam) .and. entries(i)%varied == varied_mesh) names(i) = scheme_name(entries(i))
            names(i) = trim(names(i))//', '//spaced(varied_names(entries(i)%varied))
         end do
         do i = 1, size(entries)
            if (.not. is_shown(i) .or. any(names(:i - 1) == names(i) .and. is_shown(:i - 1))) cycle
            write (unit, '(/, 2x, a)') trim(names(i))
            call print_entries(unit, pack(entries, names == names(i) .and. is_shown))
         end do
      end associate
      write (unit, '()')
      call print_line(unit, '', 'differences from the reference, up to tau = '//with_decimals(study%horizon, 3), &
         width=0)
      call print_line(unit, '', 'reference: exact motion of the model in all its modes, with a hop tolerance of '// &
         '1e-14', width=0)
      call print_check(unit, study%check)
   end subroutine print_motion

   !> Print run times and errors of some entries that vary the same setting.
   subroutine print_entries(unit, entries)
      integer, intent(in) :: unit
      type(motion_entry_t), intent(in) :: entries(:)

      type(table_t) :: table
      integer :: i

      call add_numbers(table, spaced(varied_names(entries(1)%varied)), value_of(entries), six_digits)
      call add_times(table, 'time', entries%run_time)
      call add_errors(table, entries%errors)
      call add_numbers(table, 'balance', entries%errors%energy_balance, two_digits)
      associate (is_done => entries%failure == '')
         do i = 2, size(table%columns)
            where (.not. is_done) table%columns(i)%numbers = ieee_value(1.0_wp, ieee_quiet_nan)
         end do
      end associate
      call print_table(unit, table)
      do i = 1, size(entries)
         if (entries(i)%failure /= '') call print_line(unit, '', rounded(value_of(entries(i)))//': '// &
            trim(entries(i)%failure), width=0)
      end do
   end subroutine print_entries

   !> Print the check of the reference.
   subroutine print_check(unit, check)
      integer, intent(in) :: unit
      type(check_t), intent(in) :: check

      type(table_t) :: table

      if (check%failure /= '') then
         call print_line(unit, '', 'the check of the reference failed: '//trim(check%failure), width=0)
         return
      end if
      call print_line(unit, '', 'check of the reference by average_acceleration, extrapolated from two steps, of '// &
         'which the longer is '//with_two_digits(check%steps(1)), width=0)
      write (unit, '()')
      call add_texts(table, 'difference of', [character(32) :: 'longer step and extrapolation', &
         'extrapolation and reference'])
      call add_errors(table, [check%longer_step_difference, check%difference])
      call print_table(unit, table)
   end subroutine print_check

   !> Append columns of errors of motion to a table.
   subroutine add_errors(table, errors)
      type(table_t), intent(inout) :: table
      type(motion_errors_t), intent(in) :: errors(:)

      call add_numbers(table, 'history', errors%history, two_digits)
      call add_numbers(table, 'tau_1', errors%impact_tau, two_digits)
      call add_numbers(table, 'v_1', errors%impact_velocity, two_digits)
      call add_numbers(table, 'energy', errors%energy, two_digits)
      call add_numbers(table, 'impulse', errors%impulse, two_digits)
   end subroutine add_errors

   !> Append columns of median times, and of half of their interquartile range, to a table; a time of 0 is none.
   subroutine add_times(table, name, times)
      type(table_t), intent(inout) :: table
      character(*), intent(in) :: name
      type(timing_t), intent(in) :: times(:)

      associate (is_done => times%median > 0.0_wp)
         call add_numbers(table, name//', ms', known(merge(milliseconds*times%median, -1.0_wp, is_done)), two_digits)
         call add_numbers(table, '+-', known(merge(0.5_wp*milliseconds*(times%upper_quartile - times%lower_quartile), &
            -1.0_wp, is_done)), two_digits)
      end associate
   end subroutine add_times

   !> Print the fastest run of each scheme within each error bound, and the contributions of step and mesh to the error
   !> of Newmark's method on the scene's mesh.
   subroutine print_fastest(unit, study)
      !> Unit of the output
      integer, intent(in) :: unit
      !> Results of the study
      type(precision_t), intent(in) :: study

      type(table_t) :: table
      ! scheme of each row, as an index of an entry, and the fastest entry of this scheme within the bound
      integer, allocatable :: of_scheme(:), fastest(:)
      real(wp), allocatable :: bound(:)
      integer :: i, k

      associate (entries => study%runs, beam => study%beam, schemes => schemes_of(study%runs))
         allocate (of_scheme, source=[(schemes, i=1, size(error_bounds))])
         bound = [((error_bounds(i), k=1, size(schemes)), i=1, size(error_bounds))]
         fastest = [(fastest_of(entries, entries(of_scheme(i)), bound(i)), i=1, size(bound))]
         write (unit, '()')
         call print_line(unit, '', 'fastest run with an error of eta (difference from the fine mesh) below each '// &
            'bound, up to tau = '//with_decimals(study%horizon, 3), width=0)
         write (unit, '()')
         call add_numbers(table, 'bound', bound, two_digits)
         call add_texts(table, 'method', [(scheme_name(entries(of_scheme(i))), i=1, size(bound))])
         call add_numbers(table, 'time, ms', at_entries(milliseconds*entries%run_time%median), two_digits)
         call add_numbers(table, 'elements', at_entries(real(entries%elements, wp)), whole)
         call add_numbers(table, 'step', at_entries(merge(-1.0_wp, entries%step, &
            entries%integrator == integrator_exact)), six_digits)
         call print_table(unit, table)
         write (unit, '()')
         call print_line(unit, '', 'fine mesh: exact motion, '//trim(mass_names(beam%mass))//', '// &
            to_text(beam%elements)//' elements; with half as many elements eta differs by '// &
            with_two_digits(beam%half_mesh_difference%history), width=0)
         call print_line(unit, '', 'error of eta on the fine mesh, estimated for convergence of order four: '// &
            with_two_digits(beam%uncertainty), width=0)
         if (beam%other_mass_failure /= '') then
            call print_line(unit, '', 'the run with the other mass matrix failed: '//trim(beam%other_mass_failure), &
               width=0)
         else
            call print_line(unit, '', 'with the other mass matrix (extrapolated if of order one) eta differs by '// &
               with_two_digits(beam%other_mass_difference%history), width=0)
         end if
         call print_contributions(unit, entries)
      end associate

   contains

      !> Numbers of the fastest entries; NaN: there is no entry or no number.
      function at_entries(numbers) result(values)
         real(wp), intent(in) :: numbers(:)
         real(wp) :: values(size(fastest))

         values = known([(merge(numbers(max(fastest(i), 1)), -1.0_wp, fastest(i) > 0), i=1, size(fastest))])
      end function at_entries

   end subroutine print_fastest

   !> Print the contributions of step and mesh to the error of Newmark's method on the scene's mesh.
   subroutine print_contributions(unit, entries)
      integer, intent(in) :: unit
      type(motion_entry_t), intent(in) :: entries(:)

      type(table_t) :: table
      real(wp), allocatable :: errors(:, :)
      integer, allocatable :: stepped(:)
      integer :: i

      stepped = pack([(i, i=1, size(entries))], entries%varied == varied_step)
      allocate (errors(3, size(stepped)))
      do i = 1, size(stepped)
         errors(:, i) = known(error_contributions(entries, stepped(i)))
      end do
      write (unit, '()')
      call add_texts(table, 'error of eta', integrator_names(entries(stepped)%integrator))
      call add_numbers(table, 'step', entries(stepped)%step, six_digits)
      call add_numbers(table, 'by step', errors(1, :), two_digits)
      call add_numbers(table, 'by mesh', errors(2, :), two_digits)
      call add_numbers(table, 'by both', errors(3, :), two_digits)
      call print_table(unit, table)
   end subroutine print_contributions

   !> A number that is negative if it is not known, as the tables have it: NaN if it is not known.
   elemental real(wp) function known(number)
      real(wp), intent(in) :: number

      known = number
      if (number < 0.0_wp) known = ieee_value(1.0_wp, ieee_quiet_nan)
   end function known

   !> The name of a setting in words.
   pure function spaced(name) result(words)
      character(*), intent(in) :: name
      character(:), allocatable :: words

      integer :: i

      words = trim(name)
      do i = 1, len(words)
         if (words(i:i) == '_') words(i:i) = ' '
      end do
   end function spaced

   !> Value of the setting that an entry varies.
   elemental real(wp) function value_of(entry) result(value)
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

   !> Print the times of the parts of a run.
   subroutine print_parts(unit, parts)
      integer, intent(in) :: unit
      type(timed_part_t), intent(in) :: parts(:)

      type(table_t) :: table

      write (unit, '()')
      call add_texts(table, 'part of a run by exact motion', parts%name)
      call add_times(table, 'time', parts%timing)
      call print_table(unit, table)
   end subroutine print_parts

   !> Print the run times with and without each computation that is omitted if a scene does not need it.
   subroutine print_savings(unit, savings)
      integer, intent(in) :: unit
      type(saving_t), intent(in) :: savings(:)

      type(table_t) :: table

      write (unit, '()')
      call add_texts(table, 'omitted computation', savings%name)
      call add_times(table, 'computed', savings%without)
      call add_times(table, 'omitted', savings%with)
      call add_numbers(table, 'saved, %', 100.0_wp*(1.0_wp - savings%with%median/savings%without%median), whole)
      call add_numbers(table, 'difference', known(savings%difference), two_digits)
      call add_texts(table, 'of', savings%compared)
      call print_table(unit, table)
   end subroutine print_savings

   !> Print how run times and numbers of events grow, as exponents of power laws.
   subroutine print_curves(unit, curves)
      integer, intent(in) :: unit
      type(curve_t), intent(in) :: curves(:)

      character(:), allocatable :: label
      integer :: i, last

      if (size(curves) == 0) return
      write (unit, '(/, 2x, a)') 'growth as a power'
      do i = 1, size(curves)
         associate (curve => curves(i))
            last = size(curve%abscissa)
            if (last == 0) cycle
            label = trim(curve%name)
            if (curve%unit /= '1') label = label//', '//trim(curve%unit)
            call print_line(unit, '', label//': '//trim(curve%abscissa_name)//'^'// &
               with_decimals(curve%exponent, 2)//', from '//with_two_digits(curve%ordinate(1))//' at '// &
               to_text(curve%abscissa(1))//' to '// &
               with_two_digits(curve%ordinate(last))//' at '//to_text(curve%abscissa(last)), width=2)
         end associate
      end do
   end subroutine print_curves

   !> Print run time and error of the frequency solvers, and the mesh beyond which rounding errors dominate.
   subroutine print_solvers(unit, solvers)
      integer, intent(in) :: unit
      type(solver_entry_t), intent(in) :: solvers(:)

      type(table_t) :: table
      integer :: i

      write (unit, '()')
      call add_texts(table, 'solver', solvers%solver)
      call add_numbers(table, 'elements', real(solvers%elements, wp), whole)
      call add_numbers(table, 'ratio', solvers%ratio, six_digits)
      call add_numbers(table, 'lambda_1', known(solvers%first_error), two_digits)
      call add_numbers(table, 'largest', known(solvers%largest_error), two_digits)
      call add_times(table, 'time', solvers%timing)
      call print_table(unit, table)
      write (unit, '()')
      call print_line(unit, '', 'relative errors of lambda; a dash: no exact value is known, or the solver found '// &
         'none', width=0)
      do i = 1, size(solvers)
         associate (solver => solvers(i))
            if (rounding_start(solvers, trim(solver%solver), solver%ratio) /= solver%elements) cycle
            call print_line(unit, '', trim(solver%solver)//', ratio '//rounded(solver%ratio)// &
               ': rounding errors dominate on meshes of more than '//to_text(solver%elements)//' elements', width=0)
         end associate
      end do
   end subroutine print_solvers

end module precision_tables
