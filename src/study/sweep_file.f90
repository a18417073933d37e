!> The results file of a sweep, put together from its parts, one at a time, so that memory does not grow with the
!> number of cases; under its own name it appears whole.
module sweep_file
   use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_ptr
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: move_file, replace_file
   use h5ds, only: h5dsattach_scale_f, h5dsset_scale_f
   use hdf5, only: h5aclose_f, h5acreate_f, h5awrite_f, h5dclose_f, h5dcreate_f, h5dget_space_f, h5dopen_f, h5dwrite_f, &
      h5f_acc_rdwr_f, h5fclose_f, h5fopen_f, h5gclose_f, h5gopen_f, h5p_dataset_create_f, &
      h5pclose_f, h5pcreate_f, h5pset_obj_track_times_f, h5s_scalar_f, h5s_select_set_f, h5sclose_f, h5screate_f, &
      h5screate_simple_f, h5sselect_hyperslab_f, h5t_cset_utf8_f, h5t_native_double, h5t_native_integer, h5t_string, &
      h5tclose_f, h5tcopy_f, h5tset_cset_f, hid_t, hsize_t, size_t
   use hdf5_writing, only: hdf5_group_t, open_hdf5
   use kinds, only: wp
   use measure_list, only: measure_count, measure_table
   use results_file, only: begin_results, results_name
   use scene_types, only: scene_t
   use sweep_best, only: best_t, consider, refined_t, start_best
   use sweep_parts, only: assembled_file, leave_folder, part_name, part_t, read_part, reason_room
   use sweep_plan, only: first_of_part, plan_t
   use sweep_settings, only: design_names, goal_names, parameter_t
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
   end type survey_t

contains

   !> Look through all parts.
   subroutine survey_parts(path, scene, plan, text, survey, error)
      !> Folder of the parts
      character(*), intent(in) :: path
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> What they hold
      type(survey_t), intent(out) :: survey
      !> Set when a part cannot be read
      type(failure_t), allocatable, intent(out) :: error

      type(part_t) :: part
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
      !> The part
      integer, intent(in) :: number
      !> What to say
      type(failure_t), allocatable, intent(inout) :: error

      call fail(error, status_run_failed, "'"//path//'/'//part_name(number)//"' was spoilt since it was written; " &
                //'give the same command again, and its cases are computed again')
   end subroutine complain

   !> Put the results file together and its parts away.
   subroutine write_sweep(folder, path, scene, plan, text, survey, refined, error)
      !> Folder of the results, and of the parts
      character(*), intent(in) :: folder
      character(*), intent(in) :: path
      !> The scene
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

      type(hdf5_group_t) :: root
      character(kind=c_char), allocatable :: bytes(:)

      call begin_results(root, 262144_size_t, scene)
      call write_group(root%group('sweep'), scene, plan, survey)
      if (scene%wants_best) call write_best(root%group('best'), scene, plan, survey%best, refined)
      call root%finish(bytes, error)
      if (allocated(error)) return
      call replace_file(path, assembled_file, bytes, error)
      if (allocated(error)) return
      call add_columns(path, scene, plan, text, error)
      if (allocated(error)) return
      call move_file(path//'/'//assembled_file, folder//'/'//results_name(scene), error)
      if (allocated(error)) return
      call leave_folder(path)
   end subroutine write_sweep

   !> /sweep but for its columns.
   subroutine write_group(group, scene, plan, survey)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its plan
      type(plan_t), intent(in) :: plan
      !> What the parts hold
      type(survey_t), intent(in) :: survey

      type(hdf5_group_t) :: axes
      integer :: k

      call group%note('design', trim(design_names(scene%sweep%design)))
      call group%note('parameters', joined(plan%axes%parameter%name))
      call group%note('spacings', joined([(merge('logarithmic', 'linear     ', plan%axes(k)%is_logarithmic), &
                                           k=1, size(plan%axes))]))
      call group%note('measures', joined(measure_table%name))
      call group%note('failures', [survey%failures])
      if (plan%is_grid) then
         ! a column reshaped to these extents is the grid, in C's order
         call group%note('grid_extents', [(size(plan%axes(k)%values), k=1, size(plan%axes))])
         axes = group%group('axes')
         do k = 1, size(plan%axes)
            associate (axis => plan%axes(k))
               call axes%add(trim(axis%parameter%name), axis%values, '1', &
                              trim(axis%parameter%meaning), is_scale=.true.)
            end associate
         end do
      end if
      call group%add('failed', survey%failed, '1', 'cases that failed', is_scale=.true.)
      call group%add('failure_reason', survey%reasons, 'none', 'why they failed', along='failed')
   end subroutine write_group

   !> /best: the table, and what the refinement found.
   subroutine write_best(group, scene, plan, best, refined)
      !> Its group
      type(hdf5_group_t), intent(in) :: group
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its plan
      type(plan_t), intent(in) :: plan
      !> The best cases
      type(best_t), intent(in) :: best
      !> Better ones
      type(refined_t), intent(in) :: refined

      type(hdf5_group_t) :: refinement
      integer :: i

      call group%note('measure', trim(measure_table(scene%best%measure)%name))
      call group%note('goal', trim(goal_names(scene%best%goal)))
      call group%add('place', [(i, i=1, best%count)], '1', 'place among the best', is_scale=.true.)
      call group%add('case', best%case(:best%count), '1', 'number of the case in /sweep', along='place')
      call write_columns(group, plan, best%values(:, :best%count), best%rows(:, :best%count), 'place')
      if (refined%count > 0) then
         refinement = group%group('refinement')
         call refinement%note('evaluations', [refined%all_evaluations])
         call refinement%add('evaluations', refined%evaluations(:refined%count), '1', &
                        'cases computed when it was found', is_scale=.true.)
         call write_columns(refinement, plan, refined%values(:, :refined%count), refined%rows(:, :refined%count), 'evaluations')
      end if
   end subroutine write_best

   !> Parameters and measures of a few cases, a dataset each.
   subroutine write_columns(group, plan, values, rows, along)
      !> The group
      type(hdf5_group_t), intent(in) :: group
      !> The plan
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
         call group%add(trim(plan%axes(k)%parameter%name), column, '1', &
                        trim(plan%axes(k)%parameter%meaning), along=along)
      end do
      do k = 1, measure_count
         column = rows(k, :)
         associate (measure => measure_table(k))
            if (measure%is_whole) then
               call group%add(trim(measure%name), nint(column), trim(measure%unit), trim(measure%meaning), along=along)
            else
               call group%add(trim(measure%name), column, trim(measure%unit), trim(measure%meaning), along=along)
            end if
         end associate
      end do
   end subroutine write_columns

   !> The columns of /sweep, part by part.
   subroutine add_columns(path, scene, plan, text, error)
      !> Folder of the parts; the file is there
      character(*), intent(in) :: path
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Its plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Set when a part cannot be read, or HDF5 fails
      type(failure_t), allocatable, intent(inout) :: error

      integer(hid_t) :: file, group, parameters(size(plan%axes)), measures(measure_count), case
      type(part_t) :: part
      integer, parameter :: most_rows = 16384
      real(wp), allocatable :: values(:, :), rows(:, :)
      integer :: status, number, k, i, first, held, trouble
      logical :: is_good

      trouble = 0
      call open_hdf5(status)
      call h5fopen_f(path//'/'//assembled_file, h5f_acc_rdwr_f, file, status)
      if (status /= 0) then
         call fail(error, status_run_failed, "HDF5 cannot open '"//path//'/'//assembled_file//"'")
         return
      end if
      call h5gopen_f(file, 'sweep', group, status)
      call note(status)
      call make_column('case', 'number of the case', '1', .true., 0.0_wp, case)
      call h5dsset_scale_f(case, status, 'case')
      call note(status)
      do k = 1, size(plan%axes)
         associate (parameter => plan%axes(k)%parameter)
            call make_column(trim(parameter%name), trim(parameter%meaning), '1', &
                             parameter%is_whole, 0.0_wp, parameters(k))
         end associate
      end do
      do k = 1, measure_count
         associate (measure => measure_table(k))
            call make_column(trim(measure%name), trim(measure%meaning), trim(measure%unit), measure%is_whole, &
                             merge(1.0_wp/scene%scales%omega1, 0.0_wp, measure%unit == 'tau'), measures(k))
         end associate
      end do
      allocate (values(max(most_rows, plan%part_cases), size(plan%axes)), &
                rows(max(most_rows, plan%part_cases), measure_count))
      first = 1
      held = 0
      do number = 1, plan%parts
         call read_part(path, plan, text, number, part, is_good)
         if (.not. is_good) then
            call complain(path, number, error)
            exit
         end if
         if (held + size(part%rows, 2) > size(rows, 1)) call put_all()
         do i = 1, size(part%rows, 2)
            values(held + i, :) = part%values(:, i)
            rows(held + i, :) = part%rows(:, i)
         end do
         held = held + size(part%rows, 2)
      end do
      call put_all()
      do k = 1, size(plan%axes)
         call h5dsattach_scale_f(parameters(k), case, 1, status)
         call note(status)
         call h5dclose_f(parameters(k), status)
      end do
      do k = 1, measure_count
         call h5dsattach_scale_f(measures(k), case, 1, status)
         call note(status)
         call h5dclose_f(measures(k), status)
      end do
      call h5dclose_f(case, status)
      call h5gclose_f(group, status)
      call h5fclose_f(file, status)
      call note(status)
      if (trouble < 0) call fail(error, status_run_failed, "HDF5 cannot write '"//path//'/'//assembled_file// &
                                 "'; is the disk full?")

   contains

      !> Write the rows held back.
      subroutine put_all()
         integer :: n

         call put(case, .true., first, [(real(n, wp), n=first, first + held - 1)])
         do n = 1, size(plan%axes)
            call put(parameters(n), plan%axes(n)%parameter%is_whole, first, values(:held, n))
         end do
         do n = 1, measure_count
            call put(measures(n), measure_table(n)%is_whole, first, rows(:held, n))
         end do
         first = first + held
         held = 0
      end subroutine put_all

      !> Remember a call that failed.
      subroutine note(returned)
         !> What it returned
         integer, intent(in) :: returned

         trouble = min(trouble, returned)
      end subroutine note

      !> An empty column.
      subroutine make_column(name, long_name, units, is_whole, in_scene_units, column)
         !> Name, meaning, unit
         character(*), intent(in) :: name
         character(*), intent(in) :: long_name
         character(*), intent(in) :: units
         !> Whole numbers
         logical, intent(in) :: is_whole
         !> One unit in the units of the scene; 0: not known
         real(wp), intent(in) :: in_scene_units
         !> The column, open
         integer(hid_t), intent(out) :: column

         integer(hid_t) :: space, properties, type

         call h5screate_simple_f(1, [int(plan%cases, hsize_t)], space, status)
         call h5pcreate_f(h5p_dataset_create_f, properties, status)
         call h5pset_obj_track_times_f(properties, .false., status)
         type = merge(h5t_native_integer, h5t_native_double, is_whole)
         call h5dcreate_f(group, name, type, space, column, status, dcpl_id=properties)
         call note(status)
         call h5pclose_f(properties, status)
         call h5sclose_f(space, status)
         call describe(column, 'long_name', long_name)
         call describe(column, 'units', units)
         if (in_scene_units > 0.0_wp) call attach_number(column, 'in_scene_units', in_scene_units)
      end subroutine make_column

      !> Values of a column from a case on.
      subroutine put(column, is_whole, start, values)
         !> The column
         integer(hid_t), intent(in) :: column
         !> Whole numbers
         logical, intent(in) :: is_whole
         !> The case
         integer, intent(in) :: start
         !> The values
         real(wp), intent(in) :: values(:)

         integer(hid_t) :: space, memory
         real(wp), target :: numbers(size(values))
         integer, target :: whole(size(values))
         type(c_ptr) :: address

         call h5screate_simple_f(1, [size(values, kind=hsize_t)], memory, status)
         call h5dget_space_f(column, space, status)
         call h5sselect_hyperslab_f(space, h5s_select_set_f, [int(start - 1, hsize_t)], [size(values, kind=hsize_t)], status)
         call note(status)
         if (is_whole) then
            whole = nint(values)
            address = c_loc(whole)
            call h5dwrite_f(column, h5t_native_integer, address, status, memory, space)
         else
            numbers = values
            address = c_loc(numbers)
            call h5dwrite_f(column, h5t_native_double, address, status, memory, space)
         end if
         call note(status)
         call h5sclose_f(space, status)
         call h5sclose_f(memory, status)
      end subroutine put

      !> An attribute that is a text.
      subroutine describe(object, name, words)
         !> The object
         integer(hid_t), intent(in) :: object
         !> Name and text
         character(*), intent(in) :: name
         character(*), intent(in) :: words

         character(:), allocatable, target :: terminated
         integer(hid_t) :: space, attribute, type
         type(c_ptr), target :: address

         terminated = words//achar(0)
         address = c_loc(terminated)
         call h5tcopy_f(h5t_string, type, status)
         call h5tset_cset_f(type, h5t_cset_utf8_f, status)
         call h5screate_f(h5s_scalar_f, space, status)
         call h5acreate_f(object, name, type, space, attribute, status)
         call note(status)
         call h5awrite_f(attribute, type, c_loc(address), status)
         call note(status)
         call h5aclose_f(attribute, status)
         call h5sclose_f(space, status)
         call h5tclose_f(type, status)
      end subroutine describe

      !> An attribute that is a number.
      subroutine attach_number(object, name, value)
         !> The object
         integer(hid_t), intent(in) :: object
         !> Name and value
         character(*), intent(in) :: name
         real(wp), target, intent(in) :: value

         integer(hid_t) :: space, attribute
         type(c_ptr) :: address

         address = c_loc(value)
         call h5screate_f(h5s_scalar_f, space, status)
         call h5acreate_f(object, name, h5t_native_double, space, attribute, status)
         call note(status)
         call h5awrite_f(attribute, h5t_native_double, address, status)
         call note(status)
         call h5aclose_f(attribute, status)
         call h5sclose_f(space, status)
      end subroutine attach_number

   end subroutine add_columns

   !> Names with commas between them.
   pure function joined(names) result(text)
      !> The names
      character(*), intent(in) :: names(:)
      character(:), allocatable :: text

      integer :: i

      text = trim(names(1))
      do i = 2, size(names)
         text = text//', '//trim(names(i))
      end do
   end function joined

end module sweep_file
