!> The results file of a sweep, put together from its parts, one at a time, so that memory does not grow with the
!> number of cases; under its own name it appears whole.
module sweep_file
   use analyses, only: analysed_t, write_analyses
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: move_file, remove_entries
   use hdf5_writing, only: hdf5_column_t
   use kinds, only: wp
   use measure_list, only: measure_count, measure_table
   use measure_rows, only: write_measures_of_cases
   use mesh_errors, only: mesh_errors_t, write_mesh_errors
   use quantity_groups, only: quantity_group_t
   use results_file, only: results_name, write_head
   use scene_types, only: scene_t
   use scene_units, only: units_in
   use sweep_best, only: best_t, consider, refined_t, start_best
   use sweep_parts, only: assembled_file, joined, leave_folder, part_name, part_rows_t, read_part, reason_room
   use sweep_plan, only: first_of_part, plan_t, section_values
   use sweep_settings, only: design_names, goal_names
   implicit none (type, external)
   private
   public :: survey_t, survey_parts, write_sweep

   !> So many failures are told with their reasons; the status of each is in its row.
   integer, parameter :: most_reasons = 10000

   !> What the parts hold, seen from above.
   type :: survey_t
      !> The best cases
      type(best_t) :: best
      !> Cases that failed; the first of them with their reasons
      integer :: failures = 0
      integer, allocatable :: failed(:)
      character(reason_room), allocatable :: reasons(:)
      !> Of the beam of the scene itself
      type(analysed_t), allocatable :: analysed(:)
   end type survey_t

contains

   !> Look through all parts.
   subroutine survey_parts(path, scene, plan, text, survey, error)
      !> Folder of the parts
      character(*), intent(in) :: path
      type(scene_t), intent(in) :: scene
      !> Its plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> What they hold
      type(survey_t), intent(out) :: survey
      !> Set when a part cannot be read
      type(failure_t), allocatable, intent(out) :: error

      type(part_rows_t) :: part
      character(reason_room), allocatable :: reasons(:)
      integer, allocatable :: failed(:)
      integer :: number, i, told
      logical :: is_good

      call start_best(scene, plan, survey%best)
      allocate (failed(min(most_reasons, plan%cases)), reasons(min(most_reasons, plan%cases)))
      told = 0
      do number = 1, plan%parts
         call read_part(path, plan, text, number, part, is_good)
         if (.not. is_good) then
            call complain(path, number, error)
            return
         end if
         do i = 1, size(part%rows, 2)
            call consider(survey%best, first_of_part(plan, number) + i - 1, part%values(:, i), part%rows(:, i))
         end do
         survey%failures = survey%failures + size(part%failed)
         do i = 1, min(size(part%failed), size(failed) - told)
            failed(told + i) = part%failed(i)
            reasons(told + i) = part%reasons(i)
         end do
         told = min(survey%failures, size(failed))
      end do
      allocate (survey%failed, source=failed(:told))
      allocate (survey%reasons(told))
      survey%reasons(:) = reasons(:told)
   end subroutine survey_parts

   !> A part that is no part.
   subroutine complain(path, number, error)
      !> Folder of the parts
      character(*), intent(in) :: path
      integer, intent(in) :: number
      !> What to say
      type(failure_t), allocatable, intent(inout) :: error

      call fail(error, status_run_failed, "'"//path//'/'//part_name(number)//"' was spoilt since it was written; " &
         //'give the same command again, and its cases are computed again')
   end subroutine complain

   !> Put the results file together and its parts away.
   subroutine write_sweep(folder, path, scene, plan, text, survey, refined, error, errors)
      !> Folder of the results, and of the parts
      character(*), intent(in) :: folder
      character(*), intent(in) :: path
      type(scene_t), intent(in) :: scene
      !> Its plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> What the parts hold
      type(survey_t), intent(in) :: survey
      !> Better cases between those of the sweep
      type(refined_t), intent(in) :: refined
      !> Why the file could not be written
      type(failure_t), allocatable, intent(out) :: error
      !> What the mesh does to some cases
      type(mesh_errors_t), intent(in), optional :: errors

      type(quantity_group_t) :: root, sweep
      type(failure_t), allocatable :: refusal
      character(:), allocatable :: assembled

      assembled = path//'/'//assembled_file
      ! what a killed run left, or a link, is not written through
      call remove_entries(path, [assembled_file])
      call root%begin_on_disk(assembled)
      root%units = units_in(scene)
      call write_head(root, scene)
      root%tells_symbols = .true.
      sweep = root%part('sweep')
      if (any(plan%axes%parameter%quantity == 'displacement')) sweep = sweep%as_they_are(plan%axes%parameter%quantity)
      call write_group(sweep, scene, plan, survey)
      call write_analyses(root, survey%analysed)
      if (scene%wants_best) call write_best(root%part('best'), scene, plan, survey%best, refined)
      if (present(errors)) then
         root%tells_symbols = .false.
         call write_mesh_errors(root%part('mesh_estimate'), errors)
      end if
      call write_rows(sweep, path, plan, text, is_there(scene), error)
      call root%finish_on_disk(refusal)
      if (.not. allocated(error) .and. allocated(refusal)) then
         call fail(error, refusal%status, "cannot write '"//assembled//"': "//refusal%message//'; is the disk full?')
      end if
      if (allocated(error)) return
      call move_file(assembled, folder//'/'//results_name(scene), error)
      if (allocated(error)) return
      call leave_folder(path)
   end subroutine write_sweep

   !> /sweep but for its columns.
   subroutine write_group(group, scene, plan, survey)
      type(quantity_group_t), intent(in) :: group
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      !> What the parts hold
      type(survey_t), intent(in) :: survey

      type(quantity_group_t) :: axes
      character(len(measure_table%name)) :: names(measure_count)
      integer :: k

      do k = 1, measure_count
         names(k) = group%named(measure_table(k)%name)
      end do
      call group%attribute('design', trim(design_names(scene%sweep%design)))
      call group%attribute('parameters', joined(plan%axes%parameter%name))
      call group%attribute('spacings', joined([(merge('logarithmic', 'linear     ', plan%axes(k)%is_logarithmic), &
         k=1, size(plan%axes))]))
      call group%attribute('measures', joined(pack(names, is_there(scene))))
      call group%attribute('failures', [survey%failures])
      if (plan%is_grid .and. .not. plan%goes_back) then
         ! a column reshaped to these extents is the grid, in C's order
         call group%attribute('grid_extents', [(size(plan%axes(k)%values), k=1, size(plan%axes))])
         axes = group%part('axes')
         do k = 1, size(plan%axes)
            associate (axis => plan%axes(k))
               call axes%add(trim(axis%parameter%name), axis%values, group%given_unit(axis%parameter%quantity), &
                  trim(axis%parameter%meaning), is_scale=.true.)
            end associate
         end do
      end if
      if (plan%chain > 0) then
         call group%attribute('carry', trim(scene%sweep%swept(scene%sweep%carry)%parameter%name))
         call group%attribute('chain', [plan%chain])
      end if
      call group%add('failed', survey%failed, '1', 'cases that failed', is_scale=.true.)
      call group%add('failure_reason', survey%reasons, 'none', 'why they failed', along='failed')
   end subroutine write_group

   !> Measures that a scene has.
   pure function is_there(scene) result(answer)
      type(scene_t), intent(in) :: scene
      logical :: answer(measure_count)

      answer = scene%has_group(measure_table%group)
   end function is_there

   !> /best: the table, and what the refinement found.
   subroutine write_best(group, scene, plan, best, refined)
      type(quantity_group_t), intent(in) :: group
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(in) :: plan
      type(best_t), intent(in) :: best
      !> Better ones
      type(refined_t), intent(in) :: refined

      type(quantity_group_t) :: refinement
      integer :: i

      call group%attribute('measure', group%named(measure_table(scene%best%measure)%name))
      call group%attribute('goal', trim(goal_names(scene%best%goal)))
      call group%add('place', [(i, i=1, best%count)], '1', 'place among the best', is_scale=.true.)
      call group%add('case', best%case(:best%count), '1', 'number of the case in /sweep', along='place')
      call write_columns(group, plan, best%values(:, :best%count), best%rows(:, :best%count), 'place')
      if (refined%count > 0) then
         refinement = group%part('refinement')
         call refinement%attribute('evaluations', [refined%all_evaluations])
         call refinement%add('evaluations', refined%evaluations(:refined%count), '1', &
            'cases computed when it was found', is_scale=.true.)
         call write_columns(refinement, plan, refined%values(:, :refined%count), refined%rows(:, :refined%count), &
            'evaluations')
      end if
   end subroutine write_best

   !> Parameters and measures of a few cases, a dataset each.
   subroutine write_columns(group, plan, values, rows, along)
      type(quantity_group_t), intent(in) :: group
      type(plan_t), intent(in) :: plan
      !> Parameters [axes, cases] and measures [measure_count, cases]
      real(wp), intent(in) :: values(:, :)
      real(wp), intent(in) :: rows(:, :)
      !> Dimension scale of the cases
      character(*), intent(in) :: along

      real(wp) :: column(size(values, 2))
      integer :: k

      do k = 1, size(plan%axes)
         column = values(k, :)
         call group%add(trim(plan%axes(k)%parameter%name), column, group%given_unit(plan%axes(k)%parameter%quantity), &
            trim(plan%axes(k)%parameter%meaning), along=along)
      end do
      call write_measures_of_cases(group%as_they_are(plan%axes%parameter%quantity), measure_table%name, rows, along)
   end subroutine write_columns

   !> The columns of /sweep, part by part, so many rows at a time.
   subroutine write_rows(group, path, plan, text, there, error)
      type(quantity_group_t), intent(in) :: group
      !> Folder of the parts
      character(*), intent(in) :: path
      !> The plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Measures that have a column, [measure_count]
      logical, intent(in) :: there(:)
      !> Set when a part cannot be read
      type(failure_t), allocatable, intent(inout) :: error

      integer, parameter :: most_rows = 16384
      type(hdf5_column_t) :: cases, parameters(size(plan%axes)), measures(measure_count)
      type(hdf5_column_t) :: direction, sections(section_values)
      type(part_rows_t) :: part
      real(wp), allocatable :: values(:, :), rows(:, :)
      integer :: number, i, first, held
      logical :: is_good

      call make_columns(group, plan, there, cases, parameters, measures)
      if (plan%goes_back) direction = group%column('direction', plan%cases, '1', &
         '1: on the way through the values of carry, -1: on the way back', .true., 'case')
      if (plan%sections > 0) call make_tables(group, plan, sections)
      associate (room => max(most_rows, plan%part_cases))
         allocate (values(room, size(plan%axes)), rows(room, measure_count))
      end associate
      first = 1
      held = 0
      do number = 1, plan%parts
         call read_part(path, plan, text, number, part, is_good)
         if (.not. is_good) then
            call complain(path, number, error)
            return
         end if
         if (held + size(part%rows, 2) > size(rows, 1)) call put_constrained()
         do i = 1, size(part%rows, 2)
            values(held + i, :) = part%values(:, i)
            rows(held + i, :) = part%rows(:, i)
         end do
         if (plan%sections > 0) then
            do i = 1, section_values
               call sections(i)%put(first_of_part(plan, number), &
                  reshape(part%sections(i::section_values, :), [size(part%sections)/section_values]))
            end do
         end if
         held = held + size(part%rows, 2)
      end do
      call put_constrained()

   contains

      !> Write the rows held back.
      subroutine put_constrained()
         integer :: n

         call cases%put(first, [(real(n, wp), n=first, first + held - 1)])
         if (plan%goes_back) call direction%put(first, [(merge(1.0_wp, -1.0_wp, &
            2*modulo(n - 1, plan%chain) < plan%chain), n=first, first + held - 1)])
         do n = 1, size(parameters)
            call parameters(n)%put(first, values(:held, n))
         end do
         do n = 1, measure_count
            if (there(n)) call measures(n)%put(first, rows(:held, n))
         end do
         first = first + held
         held = 0
      end subroutine put_constrained

   end subroutine write_rows

   !> The tables of sections, empty, a row a case.
   subroutine make_tables(group, plan, tables)
      type(quantity_group_t), intent(in) :: group
      type(plan_t), intent(in) :: plan
      type(hdf5_column_t), intent(out) :: tables(section_values)

      character(*), parameter :: name(section_values) = [character(32) :: 'section_displacement_stop', &
         'section_velocity_stop', 'section_displacement_tip', 'section_velocity_tip']
      character(*), parameter :: meaning(section_values) = [character(80) :: 'displacement of the stop from which ' &
         //'the beam is released, in sections', 'its velocity', 'displacement of the tip in sections', 'its velocity']
      integer :: i

      do i = 1, section_values
         tables(i) = group%put_rows(trim(name(i)), [plan%sections, plan%cases], &
            trim(merge('displacement', 'velocity    ', modulo(i, 2) == 1)), trim(meaning(i)), 'case')
      end do
   end subroutine make_tables

   !> The columns of /sweep, empty.
   subroutine make_columns(group, plan, there, cases, parameters, measures)
      type(quantity_group_t), intent(in) :: group
      type(plan_t), intent(in) :: plan
      !> Measures that have one, [measure_count]
      logical, intent(in) :: there(:)
      type(hdf5_column_t), intent(out) :: cases
      !> In the order of the axes
      type(hdf5_column_t), intent(out) :: parameters(:)
      !> In the order of their table
      type(hdf5_column_t), intent(out) :: measures(:)

      integer :: k

      cases = group%column('case', plan%cases, '1', 'number of the case', .true., is_scale=.true.)
      do k = 1, size(parameters)
         associate (parameter => plan%axes(k)%parameter)
            parameters(k) = group%column(trim(parameter%name), plan%cases, group%given_unit(parameter%quantity), &
               trim(parameter%meaning), &
               parameter%is_whole, 'case')
         end associate
      end do
      do k = 1, measure_count
         if (.not. there(k)) cycle
         associate (measure => measure_table(k))
            measures(k) = group%put_column(trim(measure%name), plan%cases, measure%quantity, measure%meaning, &
               measure%is_whole, 'case')
         end associate
      end do
   end subroutine make_columns

end module sweep_file
