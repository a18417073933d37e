!> Writes the results file of a precision study (run time against error of all methods). Some names in the file are
!> older than those of the source, and are kept for readers of the file: a group `way_1` is a scheme, a dataset
!> `..._ledger` the error of the energy balance, `skips` the computations that are omitted if a scene does not need
!> them.
module precision_file
   use, intrinsic :: iso_c_binding, only: c_size_t
   use, intrinsic :: iso_fortran_env, only: compiler_version
   use failures, only: failure_t
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: wp
   use motion_errors, only: motion_errors_t
   use number_text, only: to_text
   use precision_types, only: fastest_of, error_bounds, error_contributions, scheme_name, schemes_of, precision_t, &
      varied_names, varied_step
   use quantity_groups, only: quantity_group_t
   use results_file, only: begin_results, finish_results
   use scene_types, only: integrator_names, mass_names, scene_t
   use timed_tasks, only: kind_of_build, options_of_compiler, processor_name, clock_resolution, timing_t
   implicit none (type, external)
   private
   public :: write_precision

contains

   !> Write the complete results file; after an error no incomplete file is left.
   subroutine write_precision(folder, scene, study, error)
      !> Folder of the results file
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      type(precision_t), intent(in) :: study
      !> Reason why the file could not be written
      type(failure_t), allocatable, intent(out) :: error

      ! estimated size of the file
      integer(c_size_t), parameter :: expected_bytes = 262144_c_size_t
      type(quantity_group_t) :: root
      type(hdf5_group_t) :: group

      call begin_results(root, expected_bytes, scene)
      group = root%group('precision')
      call group%attribute('processor', processor_name())
      call group%attribute('compiler', compiler_version())
      call group%attribute('compiler_options', options_of_compiler())
      call group%attribute('build', kind_of_build())
      call group%attribute('clock_resolution', clock_resolution())
      if (allocated(study%runs)) call write_motion(group%group('motion'), study)
      if (allocated(study%beam)) call write_beam(group%group('beam'), study)
      if (allocated(study%parts)) call write_parts(group%group('parts'), study)
      if (allocated(study%curves)) call write_curves(group%group('growth'), study)
      if (allocated(study%savings)) call write_savings(group%group('skips'), study)
      if (allocated(study%solvers)) call write_solvers(group%group('solvers'), study)
      call finish_results(root, folder, scene, error)
   end subroutine write_precision

   !> Write run time and error of motion, and the check of the reference.
   subroutine write_motion(group, study)
      type(hdf5_group_t), intent(in) :: group
      type(precision_t), intent(in) :: study

      character(*), parameter :: along = 'entry'
      type(hdf5_group_t) :: check
      integer :: i

      associate (entries => study%runs)
         call group%attribute('horizon', study%horizon)
         call group%add(along, [(i, i=1, size(entries))], '1', 'one method at one setting', is_scale=.true.)
         call group%add('method', integrator_names(entries%integrator), 'none', 'method of integration', along=along)
         call group%add('varied', varied_names(entries%varied), 'none', 'what differs from the neighbouring entries', &
            along=along)
         call group%add('step', entries%step, '1', 'step, tau; of exact motion: interval of the samples compared', &
            along=along)
         call group%add('hop_tolerance', entries%hop_tolerance, '1', 'lower flights, in eta, count as contact', &
            along=along)
         call group%add('mode_tolerance', entries%mode_tolerance, '1', &
            'tolerance of eta for the omission of modes', along=along)
         call group%add('elements', entries%elements, '1', 'elements of the mesh', along=along)
         call group%add('mass', mass_names(entries%mass), 'none', 'mass matrix', along=along)
         call write_timings(group, 'seconds', entries%run_time, &
            'median time of a run that records only events, without assembly of the beam', along)
         call group%add('timings', entries%run_time%timings, '1', 'number of timings', along=along)
         call group%add('runs_each', entries%run_time%runs_each, '1', 'runs within each timing', along=along)
         call group%add('seconds_motion', entries%motion_time%median, 's', &
            'median time of such a run without the computation of modes', along=along)
         call group%add('events', entries%event_count, '1', 'number of events', along=along)
         call group%add('modes_kept', entries%retained_modes, '1', 'modes kept', along=along)
         call group%add('evaluations', real(entries%evaluations, wp), '1', 'steps, or modal sums evaluated', &
            along=along)
         call write_errors(group, 'error', entries%errors, along)
         call group%add('failure', entries%failure, 'none', 'reason why there are no figures; empty: there are', &
            along=along)
         check = group%group('check')
         call check%attribute('what', &
            'the reference (exact motion, all modes, tightest hop tolerance) against Newmark with ' &
            //'beta = 1/4, events located to rounding, extrapolated from two steps to a step of zero')
         call check%attribute('steps', study%check%steps)
         call check%attribute('failure', study%check%failure)
         call check%add('pair', [1, 2], '1', &
            '1: the longer step and the extrapolation; 2: the extrapolation and the reference', is_scale=.true.)
         call write_errors(check, 'difference', [study%check%longer_step_difference, study%check%difference], 'pair')
      end associate
   end subroutine write_motion

   !> Write the run on the finest mesh, which represents the continuous beam, and the fastest run of each scheme within
   !> each error bound.
   subroutine write_beam(group, study)
      type(hdf5_group_t), intent(in) :: group
      !> Results of the study
      type(precision_t), intent(in) :: study

      type(hdf5_group_t) :: child
      ! indices of the entries that vary the step
      integer, allocatable :: varied(:)
      ! contributions to the errors of these entries: of the step, of the mesh, and of both, [3, entries]
      real(wp), allocatable :: parts(:, :)
      integer :: i, k

      associate (beam => study%beam, entries => study%runs, schemes => schemes_of(study%runs))
         call group%attribute('elements', real(beam%elements, wp))
         call group%attribute('mass', mass_names(beam%mass))
         call group%attribute('uncertainty', beam%uncertainty)
         ! why there is no run with the other mass matrix; empty: there is one
         call group%attribute('no_other_mass', beam%other_mass_failure)
         call group%add('pair', [1, 2], '1', &
            'difference from the run on the finest mesh: 1: of the run on half as many elements; ' &
            //'2: of the run with the other mass matrix', is_scale=.true.)
         call write_errors(group, 'difference', [beam%half_mesh_difference, beam%other_mass_difference], 'pair')
         do k = 1, size(schemes)
            child = group%group('way_'//to_text(k))
            call child%attribute('name', scheme_name(entries(schemes(k))))
            call child%add('error', error_bounds, '1', 'bound of the difference of eta from the beam', is_scale=.true.)
            call child%add('entry', [(fastest_of(entries, entries(schemes(k)), error_bounds(i)), i=1, &
               size(error_bounds))], '1', 'index in ../../motion of the fastest entry within the bound; 0: none', &
               along='error')
         end do
         allocate (varied, source=pack([(i, i=1, size(entries))], entries%varied == varied_step))
         child = group%group('parts_of_error')
         call child%add('entry', varied, '1', 'entry of ../../motion: steps on the mesh of the scene', is_scale=.true.)
         allocate (parts(3, size(varied)))
         do i = 1, size(varied)
            parts(:, i) = error_contributions(entries, varied(i))
         end do
         call child%add('step', parts(1, :), '1', 'error of eta against exact motion on that mesh', along='entry')
         call child%add('mesh', parts(2, :), '1', 'error of exact motion on that mesh; -1: not known', along='entry')
         call child%add('both', parts(3, :), '1', 'error against the beam; -1: not known', along='entry')
      end associate
   end subroutine write_beam

   !> Write a dataset for each error quantity.
   subroutine write_errors(group, prefix, errors, along)
      type(hdf5_group_t), intent(in) :: group
      !> First part of the names of the datasets
      character(*), intent(in) :: prefix
      type(motion_errors_t), intent(in) :: errors(:)
      !> Name of the dimension scale
      character(*), intent(in) :: along

      call group%add(prefix//'_impact_tau', errors%impact_tau, '1', 'error of the instant of the first impact, tau', &
         along=along)
      call group%add(prefix//'_impact_velocity', errors%impact_velocity, '1', &
         'relative error of the velocity of the first impact', along=along)
      call group%add(prefix//'_history', errors%history, '1', &
         'maximum error of eta at stop or tip up to the horizon', along=along)
      call group%add(prefix//'_energy', errors%energy, '1', &
         'error of the energy at the horizon, over the energy at the start', along=along)
      call group%add(prefix//'_impulse', errors%impulse, '1', &
         'relative error of the contact impulse up to the horizon', along=along)
      call group%add(prefix//'_ledger', errors%energy_balance, '1', &
         'maximum error of the energy balance over the energy at the start', along=along)
   end subroutine write_errors

   !> Write medians and quartiles of timings.
   subroutine write_timings(group, name, timings, meaning, along)
      type(hdf5_group_t), intent(in) :: group
      !> Name of the dataset of the medians, which begins those of the quartiles
      character(*), intent(in) :: name
      type(timing_t), intent(in) :: timings(:)
      !> Meaning of the medians
      character(*), intent(in) :: meaning
      character(*), intent(in) :: along

      call group%add(name, timings%median, 's', meaning, along=along)
      call group%add(name//'_lower_quartile', timings%lower_quartile, 's', 'lower quartile of the same times', &
         along=along)
      call group%add(name//'_upper_quartile', timings%upper_quartile, 's', 'upper quartile of the same times', &
         along=along)
   end subroutine write_timings

   !> Write the times of the parts of a run.
   subroutine write_parts(group, study)
      type(hdf5_group_t), intent(in) :: group
      type(precision_t), intent(in) :: study

      integer :: i

      associate (parts => study%parts)
         call group%add('part', [(i, i=1, size(parts))], '1', 'part of a run', is_scale=.true.)
         call group%add('name', parts%name, 'none', 'which part', along='part')
         call write_timings(group, 'seconds', parts%timing, 'median', 'part')
      end associate
   end subroutine write_parts

   !> Write the run times with each computation that a scene may not need (`..._without` the skip) and without it.
   subroutine write_savings(group, study)
      type(hdf5_group_t), intent(in) :: group
      type(precision_t), intent(in) :: study

      character(*), parameter :: along = 'skip'
      integer :: i

      associate (savings => study%savings)
         call group%add(along, [(i, i=1, size(savings))], '1', &
            'computation that is omitted if a scene does not need it', is_scale=.true.)
         call group%add('name', savings%name, 'none', 'computation that is omitted', along=along)
         call write_timings(group, 'seconds_without', savings%without, 'median time with this computation', along)
         call write_timings(group, 'seconds_with', savings%with, 'median time if it is omitted', along)
         call group%add('difference', savings%difference, '1', &
            'maximum difference of the two answers; -1: none to compare', along=along)
         call group%add('compared', savings%compared, 'none', 'quantity whose difference it is', along=along)
      end associate
   end subroutine write_savings

   !> Write growth of time and memory, one group for each curve.
   subroutine write_curves(group, study)
      type(hdf5_group_t), intent(in) :: group
      type(precision_t), intent(in) :: study

      type(hdf5_group_t) :: child
      integer :: i

      do i = 1, size(study%curves)
         associate (curve => study%curves(i))
            child = group%group('curve_'//to_text(i))
            call child%attribute('name', trim(curve%name))
            call child%attribute('exponent', curve%exponent)
            call child%add('x', curve%abscissa, '1', trim(curve%abscissa_name), is_scale=.true.)
            call child%add('y', curve%ordinate, trim(curve%unit), trim(curve%name), along='x')
         end associate
      end do
   end subroutine write_curves

   !> Write run time and error of the frequency solvers.
   subroutine write_solvers(group, study)
      type(hdf5_group_t), intent(in) :: group
      type(precision_t), intent(in) :: study

      character(*), parameter :: along = 'entry'
      integer :: i

      associate (entries => study%solvers)
         call group%add(along, [(i, i=1, size(entries))], '1', 'a solver on a mesh', is_scale=.true.)
         call group%add('solver', entries%solver, 'none', 'solver', along=along)
         call group%add('elements', entries%elements, '1', 'elements of the mesh', along=along)
         call group%add('ratio', entries%ratio, '1', 'ratio of the lengths of neighbouring elements', &
            along=along)
         call write_timings(group, 'seconds', entries%timing, 'median', along)
         call group%add('error_first', entries%first_error, '1', 'relative error of lambda_1; -1: not known', &
            along=along)
         call group%add('error_largest', entries%largest_error, '1', &
            'maximum relative error of all requested modes; -1: not known', along=along)
      end associate
   end subroutine write_solvers

end module precision_file
