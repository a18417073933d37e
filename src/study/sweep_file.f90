!> The results file of a sweep. The file is assembled from the chunks one at a time, so that memory does not grow with
!> the number of cases, and gets its final name when it is complete.
module sweep_file
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use analyses, only: analysed_t, write_analyses
   use failures, only: fail, failure_t
   use file_system, only: move_file, remove_entries
   use hdf5_writing, only: hdf5_column_t
   use kinds, only: pi, wp
   use measure_list, only: measure_count, measure_named, measure_settling, measure_table, measure_tolerance
   use measure_rows, only: write_measure_lists
   use mesh_errors, only: mesh_errors_t, write_mesh_errors
   use printable_text, only: joined
   use quantities, only: quantity_named, units_of, units_t, are_physical, units_in
   use quantity_groups, only: quantity_group_t
   use results_file, only: results_name, write_header
   use run_warnings, only: ends_unsettled, half_period_of
   use scene_beam_model, only: varies_at_end
   use scene_reader, only: draft_t, set_parameters
   use scene_types, only: scene_t
   use sweep_best, only: best_t, insert_case, refined_t, start_best
   use sweep_chunks, only: assembled_file, remove_chunk_folder, chunk_rows_t, load_chunk, max_reason_length
   use sweep_plan, only: first_of_chunk, plan_t, section_values
   use sweep_settings, only: design_names, goal_names, varies_scales
   use sweep_spectra, only: make_spectra, write_spectra
   implicit none (type, external)
   private
   public :: summary_t, survey_t, survey_chunks, write_sweep

   !> Maximum number of failures whose reasons are stored; the status of each case is in its row.
   integer, parameter :: max_reasons = 10000

   !> Result computed from the rows of all cases; each extension holds one kind of result.
   type, abstract :: summary_t
   contains
      procedure(write_interface), deferred :: write
   end type summary_t

   abstract interface
      !> Write the result as a group of the file.
      subroutine write_interface(self, root)
         import :: quantity_group_t, summary_t
         implicit none (type, external)
         class(summary_t), intent(in) :: self
         !> Root group of the file
         type(quantity_group_t), intent(in) :: root
      end subroutine write_interface
   end interface

   !> Summary of all chunks: failures and best cases.
   type :: survey_t
      !> The best cases
      type(best_t) :: best
      !> Number of cases that failed
      integer :: failure_count = 0
      !> Numbers of the first cases that failed, at most `max_reasons`
      integer, allocatable :: failed_cases(:)
      !> Reasons of their failures
      character(max_reason_length), allocatable :: reasons(:)
      !> Tolerance of the extremes of each case; NaN: the usual tolerance, [cases]
      real(wp), allocatable :: tolerance(:)
      !> Number of cases that end less than half a period of the first frequency after their settling time
      integer :: unsettled_count = 0
      !> Number of cases whose maximum stress exceeds the strength; 0 if the cases have units of stress of their own
      integer :: over_strength_count = 0
      !> Selected measures of all cases, [cases, measures]; unallocated: none is selected
      real(wp), allocatable :: values(:, :)
      !> Analyses of the beam of the scene, independent of the cases
      type(analysed_t), allocatable :: analysed(:)
      !> Result computed from the rows of all cases; unallocated: none
      class(summary_t), allocatable :: summary
   end type survey_t

contains

   !> Read all chunks and summarise them.
   subroutine survey_chunks(scene, plan, survey, error, measures)
      type(scene_t), intent(in) :: scene
      !> Plan of the sweep
      type(plan_t), intent(in) :: plan
      !> Summary of the chunks
      type(survey_t), intent(out) :: survey
      !> Set if a chunk cannot be read
      type(failure_t), allocatable, intent(out) :: error
      !> Indices in `measure_table` of the measures of which all values are kept; absent: none
      integer, intent(in), optional :: measures(:)

      type(chunk_rows_t) :: chunk
      ! scene of a case, for its duration and its unit of time; allocated, because the type is large
      type(scene_t), allocatable :: of_case
      type(draft_t), allocatable :: draft
      character(:), allocatable :: problem
      ! half a period of the first mode; if it varies between the cases, that of the uniform beam
      real(wp) :: half_period
      ! strength of the material in the unit of stress of the rows
      real(wp) :: strength
      integer :: number, i, stress
      ! whether each parameter changes the duration tau or the unit of time of a case, [axes]
      logical :: changes_duration(size(plan%axes))
      ! values of the parameters in `of_case`; at first none
      real(wp) :: values(size(plan%axes))
      logical :: may_be_unsettled

      call start_best(scene, plan, survey%best)
      may_be_unsettled = scene%has_stop .and. .not. varies_at_end(scene)
      half_period = pi
      if (may_be_unsettled .and. .not. any(plan%axes%parameter%changes_beam)) half_period = half_period_of(scene)
      associate (parameter => plan%axes%parameter)
         changes_duration = parameter%changes_scales .or. (parameter%group == 'response' .and. &
            index(parameter%name_in_group, 'duration') == 1)
      end associate
      allocate (of_case, source=scene)
      allocate (draft)
      values = huge(1.0_wp)
      strength = strength_in_rows(scene, any(varies_scales(plan%axes%parameter)))
      stress = measure_named('greatest_stress')
      allocate (survey%failed_cases(0), survey%reasons(0), survey%tolerance(plan%cases))
      if (present(measures)) allocate (survey%values(plan%cases, size(measures)))
      do number = 1, plan%chunks
         call load_chunk(plan, number, chunk, error)
         if (allocated(error)) return
         associate (first => first_of_chunk(plan, number))
            do i = 1, size(chunk%rows, 2)
               call insert_case(survey%best, first + i - 1, chunk%values(:, i), chunk%rows(:, i))
               survey%tolerance(first + i - 1) = chunk%rows(measure_tolerance, i)
               if (present(measures)) survey%values(first + i - 1, :) = chunk%rows(measures, i)
               ! NaN: the case failed
               if (ieee_is_nan(chunk%rows(stress, i))) cycle
               if (chunk%rows(stress, i) > strength) survey%over_strength_count = survey%over_strength_count + 1
            end do
         end associate
         do i = 1, merge(size(chunk%rows, 2), 0, may_be_unsettled)
            associate (settling_time => chunk%rows(measure_settling, i))
               if (ieee_is_nan(settling_time)) cycle
               if (any(changes_duration .and. abs(chunk%values(:, i) - values) > 0.0_wp)) then
                  values = chunk%values(:, i)
                  call set_parameters(of_case, plan%axes%parameter, values, problem, draft)
               end if
               survey%unsettled_count = survey%unsettled_count + merge(1, 0, &
                  ends_unsettled(settling_time/unit_of_time(of_case), of_case%response%duration, half_period))
            end associate
         end do
         survey%failure_count = survey%failure_count + size(chunk%failed)
         associate (recorded => min(size(chunk%failed), max_reasons - size(survey%failed_cases)))
            survey%failed_cases = [survey%failed_cases, chunk%failed(:recorded)]
            survey%reasons = [survey%reasons, chunk%reasons(:recorded)]
         end associate
      end do
   end subroutine survey_chunks

   !> Strength of the material in the unit of stress of the rows; `huge`: the scene gives none, or that unit differs
   !> from case to case.
   pure real(wp) function strength_in_rows(scene, scales_vary) result(strength)
      type(scene_t), intent(in) :: scene
      !> Whether the cases differ in their scales
      logical, intent(in) :: scales_vary

      type(units_t) :: units

      strength = huge(1.0_wp)
      if (scene%stress%strength <= 0.0_wp) return
      if (are_physical(scene)) then
         strength = scene%stress%strength
      else if (scene%scales%displacement > 0.0_wp .and. .not. scales_vary) then
         units = units_of(scene%scales, scene%unit_system, .true.)
         strength = scene%stress%strength/units%factor(quantity_named('stress'))
      end if
   end function strength_in_rows

   !> Unit of time of the rows of a case, over tau.
   pure real(wp) function unit_of_time(scene) result(ratio)
      type(scene_t), intent(in) :: scene

      type(units_t) :: units

      ratio = 1.0_wp
      if (.not. are_physical(scene)) return
      units = units_in(scene)
      ratio = units%factor(quantity_named('time'))
   end function unit_of_time

   !> Assemble the results file, and remove the chunks.
   subroutine write_sweep(folder, scene, plan, survey, refined, error, errors)
      !> Folder of the results
      character(*), intent(in) :: folder
      type(scene_t), intent(in) :: scene
      !> Plan of the sweep
      type(plan_t), intent(in) :: plan
      !> Summary of the chunks
      type(survey_t), intent(in) :: survey
      !> Improvements between the cases of the sweep
      type(refined_t), intent(in) :: refined
      !> Set if the file cannot be written
      type(failure_t), allocatable, intent(out) :: error
      !> Estimated errors of the mesh for some cases
      type(mesh_errors_t), intent(in), optional :: errors

      type(quantity_group_t) :: root, grid, maps, sweep
      type(hdf5_column_t), allocatable :: spectra(:)
      type(failure_t), allocatable :: refusal
      character(:), allocatable :: assembled

      assembled = plan%path//'/'//assembled_file
      ! an incomplete file of a killed run, or a link, is removed instead of overwritten
      call remove_entries(plan%path, [assembled_file])
      call root%begin_on_disk(assembled)
      root%units = units_in(scene)
      call write_header(root, scene)
      root%symbols_as_units = .true.
      sweep = root%subgroup('sweep')
      if (any(varies_scales(plan%axes%parameter))) sweep = sweep%unscaled(scales_vary=.true.)
      call write_group(sweep, scene, plan, survey)
      call write_analyses(root, survey%analysed)
      if (allocated(survey%summary)) call survey%summary%write(root)
      if (scene%wants_best) call write_best(root%subgroup('best'), scene, plan, survey%best, refined)
      if (present(errors)) then
         root%symbols_as_units = .false.
         call write_mesh_errors(root%subgroup('mesh_estimate'), errors)
      end if
      if (scene%wants_spectrum) then
         maps = root%subgroup('sweep_spectrum')
         call make_spectra(maps, scene, plan%cases, .not. sweep%scales_values, spectra)
      end if
      call write_rows(sweep, plan, scene%has_group(measure_table%group), spectra, error)
      if (plan%is_grid .and. .not. plan%goes_back) then
         grid = root%subgroup('grid')
         if (.not. sweep%scales_values) grid = grid%unscaled(scales_vary=.true.)
         call write_grid(grid, plan, scene%has_group(measure_table%group))
      end if
      call root%finish_on_disk(refusal)
      if (.not. allocated(error) .and. allocated(refusal)) then
         call fail(error, refusal%status, "cannot write '"//assembled//"': "//refusal%message//'; is the disk full?')
      end if
      if (allocated(error)) return
      call move_file(assembled, folder//'/'//results_name(scene), error)
      if (allocated(error)) return
      call remove_chunk_folder(plan%path)
   end subroutine write_sweep

   !> Write the group /sweep except its columns.
   subroutine write_group(group, scene, plan, survey)
      type(quantity_group_t), intent(in) :: group
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> Summary of the chunks
      type(survey_t), intent(in) :: survey

      character(len(measure_table%name)) :: names(measure_count)
      logical :: leads(size(plan%axes))
      integer :: k

      do k = 1, measure_count
         names(k) = group%named(measure_table(k)%name)
      end do
      call group%attribute('design', trim(design_names(scene%sweep%design)))
      call group%attribute('parameters', joined(plan%axes%parameter%name, ', '))
      call group%attribute('spacings', joined([(merge('logarithmic', 'linear     ', plan%axes(k)%is_logarithmic), &
         k=1, size(plan%axes))], ', '))
      call group%attribute('measures', joined(pack(names, scene%has_group(measure_table%group)), ', '))
      call group%attribute('failures', [survey%failure_count])
      if (plan%is_grid .and. .not. plan%goes_back) then
         ! a column reshaped to these extents is the grid, in the array order of C
         leads = plan%axes%leader == 0
         call group%attribute('grid_parameters', joined(pack(plan%axes%parameter%name, leads), ', '))
         call group%attribute('grid_extents', pack([(size(plan%axes(k)%values), k=1, size(plan%axes))], leads))
      end if
      if (plan%chain > 0) then
         call group%attribute('carry', trim(scene%sweep%swept(scene%sweep%carry)%parameter%name))
         call group%attribute('chain', [plan%chain])
      end if
      call group%add('failed', survey%failed_cases, '1', 'cases that failed', is_scale=.true.)
      call group%add('failure_reason', survey%reasons, 'none', 'why they failed', along='failed')
   end subroutine write_group

   !> Write the group /grid: the values of each parameter, and the measures of /sweep as tables with an axis for each
   !> parameter.
   subroutine write_grid(group, plan, has_column)
      type(quantity_group_t), intent(in) :: group
      type(plan_t), intent(in) :: plan
      !> Whether each measure has a column in /sweep, [measure_count]
      logical, intent(in) :: has_column(:)

      integer :: extents(size(plan%axes)), k
      logical :: leads(size(plan%axes))

      leads = plan%axes%leader == 0
      do k = 1, size(plan%axes)
         associate (axis => plan%axes(k))
            if (leads(k)) call group%add(trim(axis%parameter%name), axis%values, &
               group%scene_unit(axis%parameter%quantity), trim(axis%parameter%meaning), is_scale=.true.)
            extents(k) = size(axis%values)
         end associate
      end do
      ! a parameter that is tied to another parameter has its values along the axis of the other parameter
      do k = 1, size(plan%axes)
         associate (axis => plan%axes(k))
            if (.not. leads(k)) call group%add(trim(axis%parameter%name), axis%values, &
               group%scene_unit(axis%parameter%quantity), trim(axis%parameter%meaning), &
               along=trim(plan%axes(axis%leader)%parameter%name))
         end associate
      end do
      do k = 1, measure_count
         if (has_column(k)) call group%put_view(trim(measure_table(k)%name), '/sweep', pack(extents, leads), &
            pack(plan%axes%parameter%name, leads), measure_table(k)%quantity, measure_table(k)%meaning, &
            measure_table(k)%is_whole)
      end do
   end subroutine write_grid

   !> Write the group /best: the best cases, and the improvements of the refinement.
   subroutine write_best(group, scene, plan, best, refined)
      type(quantity_group_t), intent(in) :: group
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(best_t), intent(in) :: best
      !> Improvements
      type(refined_t), intent(in) :: refined

      type(quantity_group_t) :: refinement
      integer :: i

      call group%attribute('measure', group%named(measure_table(scene%best%measure)%name))
      call group%attribute('goal', trim(goal_names(scene%best%goal)))
      call group%add('place', [(i, i=1, best%count)], '1', 'place among the best', is_scale=.true.)
      call group%add('case', best%case(:best%count), '1', 'number of the case in /sweep', along='place')
      call write_columns(group, plan, best%values(:, :best%count), best%rows(:, :best%count), 'place')
      if (refined%count > 0) then
         refinement = group%subgroup('refinement')
         call refinement%attribute('evaluations', [refined%all_evaluations])
         call refinement%add('evaluations', refined%evaluations(:refined%count), '1', &
            'cases computed when it was found', is_scale=.true.)
         call write_columns(refinement, plan, refined%values(:, :refined%count), refined%rows(:, :refined%count), &
            'evaluations')
      end if
   end subroutine write_best

   !> Write the parameters and measures of a few cases, one dataset for each.
   subroutine write_columns(group, plan, values, rows, along)
      type(quantity_group_t), intent(in) :: group
      type(plan_t), intent(in) :: plan
      !> Parameters of the cases, [axes, cases]
      real(wp), intent(in) :: values(:, :)
      !> Measures of the cases, [measure_count, cases]
      real(wp), intent(in) :: rows(:, :)
      !> Dimension scale of the cases
      character(*), intent(in) :: along

      real(wp) :: column(size(values, 2))
      integer :: k

      do k = 1, size(plan%axes)
         column = values(k, :)
         call group%add(trim(plan%axes(k)%parameter%name), column, group%scene_unit(plan%axes(k)%parameter%quantity), &
            trim(plan%axes(k)%parameter%meaning), along=along)
      end do
      call write_measure_lists(group%unscaled(any(varies_scales(plan%axes%parameter))), measure_table%name, &
         rows, along)
   end subroutine write_columns

   !> Write the columns of /sweep chunk by chunk; rows are buffered and written up to `max_rows` at a time, or one chunk
   !> if it is longer.
   subroutine write_rows(group, plan, has_column, spectra, error)
      type(quantity_group_t), intent(in) :: group
      !> The plan
      type(plan_t), intent(in) :: plan
      !> Whether each measure has a column in /sweep, [measure_count]
      logical, intent(in) :: has_column(:)
      type(hdf5_column_t), allocatable, intent(in) :: spectra(:)
      !> Set if a chunk cannot be read
      type(failure_t), allocatable, intent(inout) :: error

      integer, parameter :: max_rows = 16384
      type(hdf5_column_t) :: cases, parameters(size(plan%axes)), measures(measure_count)
      type(hdf5_column_t) :: direction, sections(section_values)
      type(chunk_rows_t) :: chunk
      real(wp), allocatable :: values(:, :), rows(:, :)
      integer :: number, i, first, buffered

      call make_columns(group, plan, has_column, cases, parameters, measures)
      if (plan%goes_back) direction = group%column('direction', [plan%cases], '1', &
         '1: on the way through the values of carry, -1: on the way back', .true., 'case')
      if (plan%sections > 0) call make_tables(group, plan, sections)
      allocate (values(max(max_rows, plan%chunk_cases), size(plan%axes)))
      allocate (rows(size(values, 1), measure_count))
      first = 1
      buffered = 0
      do number = 1, plan%chunks
         call load_chunk(plan, number, chunk, error)
         if (allocated(error)) return
         if (buffered + size(chunk%rows, 2) > size(rows, 1)) call write_buffered()
         ! column by column, because the rows of a column are contiguous in the buffers
         associate (next => buffered + 1, last => buffered + size(chunk%rows, 2))
            do i = 1, size(values, 2)
               values(next:last, i) = chunk%values(i, :)
            end do
            do i = 1, measure_count
               if (has_column(i)) rows(next:last, i) = chunk%rows(i, :)
            end do
         end associate
         if (plan%sections > 0) then
            do i = 1, section_values
               call sections(i)%put(first_of_chunk(plan, number), &
                  reshape(chunk%extras(i:section_values*plan%sections:section_values, :), &
                  [plan%sections*size(chunk%extras, 2)]))
            end do
         end if
         if (plan%spectra > 0) call write_spectra(spectra, first_of_chunk(plan, number), &
            chunk%extras(section_values*plan%sections + 1:, :))
         buffered = buffered + size(chunk%rows, 2)
      end do
      call write_buffered()

   contains

      !> Write the buffered rows.
      subroutine write_buffered()
         integer :: n

         call cases%put(first, [(real(n, wp), n=first, first + buffered - 1)])
         ! the first half of a chain is the way forwards
         if (plan%goes_back) call direction%put(first, [(merge(1.0_wp, -1.0_wp, &
            2*modulo(n - 1, plan%chain) < plan%chain), n=first, first + buffered - 1)])
         do n = 1, size(parameters)
            call parameters(n)%put(first, values(:buffered, n))
         end do
         do n = 1, measure_count
            if (has_column(n)) call measures(n)%put(first, rows(:buffered, n))
         end do
         first = first + buffered
         buffered = 0
      end subroutine write_buffered

   end subroutine write_rows

   !> Create the empty tables of Poincare sections, one row for each case and one table for each value of a section.
   subroutine make_tables(group, plan, tables)
      type(quantity_group_t), intent(in) :: group
      type(plan_t), intent(in) :: plan
      type(hdf5_column_t), intent(out) :: tables(section_values)

      character(*), parameter :: name(section_values) = [character(32) :: 'section_displacement_stop', &
         'section_velocity_stop', 'section_displacement_tip', 'section_velocity_tip']
      character(*), parameter :: meaning(section_values) = [character(112) :: 'displacement of the beam at the ' &
         //'stop of the release, without a stop relative to the first body, in sections', 'its velocity', &
         'displacement of the tip in sections', 'its velocity']
      integer :: i

      do i = 1, section_values
         tables(i) = group%put_column(trim(name(i)), [plan%sections, plan%cases], &
            trim(merge('displacement', 'velocity    ', modulo(i, 2) == 1)), trim(meaning(i)), .false., 'case')
      end do
   end subroutine make_tables

   !> Create the empty columns of /sweep.
   subroutine make_columns(group, plan, has_column, cases, parameters, measures)
      type(quantity_group_t), intent(in) :: group
      type(plan_t), intent(in) :: plan
      !> Whether each measure has a column in /sweep, [measure_count]
      logical, intent(in) :: has_column(:)
      type(hdf5_column_t), intent(out) :: cases
      !> Columns of the parameters, in the order of the axes
      type(hdf5_column_t), intent(out) :: parameters(:)
      !> Columns of the measures, in the order of `measure_table`
      type(hdf5_column_t), intent(out) :: measures(:)

      integer :: k

      cases = group%column('case', [plan%cases], '1', 'number of the case', .true., is_scale=.true.)
      do k = 1, size(parameters)
         associate (parameter => plan%axes(k)%parameter)
            parameters(k) = group%column(trim(parameter%name), [plan%cases], group%scene_unit(parameter%quantity), &
               trim(parameter%meaning), parameter%is_whole, 'case')
         end associate
      end do
      do k = 1, measure_count
         if (.not. has_column(k)) cycle
         associate (measure => measure_table(k))
            measures(k) = group%put_column(trim(measure%name), [plan%cases], measure%quantity, measure%meaning, &
               measure%is_whole, 'case')
         end associate
      end do
   end subroutine make_columns

end module sweep_file
