!> The parts of a sweep on disk while it runs: files of some hundred rows each, written aside and renamed into place,
!> so that whatever ends the run each of them is whole or absent. Beside them lies the plan they belong to.
module sweep_parts
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_loc, c_null_char, c_ptr, c_size_t
   use, intrinsic :: iso_fortran_env, only: error_unit
   use checksums, only: checksum
   use failures, only: fail, failure_t, status_bad_input
   use file_system, only: entry_length, final_name, folder_entries, kind_folder, kind_nothing, kind_of, load_file, &
      make_new_folder, remove_empty_folder, remove_entries, replace_file
   use hdf5, only: h5dclose_f, h5dget_space_f, h5dopen_f, h5dread_f, h5f_acc_rdonly_f, h5fclose_f, h5fopen_f, &
      h5p_file_access_f, h5pclose_f, h5pcreate_f, h5pset_fapl_core_f, h5pset_file_image_f, h5sclose_f, &
      h5sget_simple_extent_npoints_f, h5t_cset_utf8_f, h5t_native_double, h5t_native_integer, h5t_string, h5tclose_f, &
      h5tcopy_f, h5tset_cset_f, hid_t, hsize_t, size_t
   use hdf5_writing, only: c_free, hdf5_group_t, open_hdf5
   use kinds, only: i8, wp
   use measure_list, only: measure_count, measure_status, measure_table
   use program_identity, only: program_name
   use results_claim, only: refuse_foreign
   use sweep_plan, only: first_of_part, last_of_part, plan_t
   implicit none (type, external)
   private
   public :: part_t, parts_folder, enter_folder, leave_folder, part_is_done, part_name, write_part, read_part
   public :: reason_room, assembled_file

   !> Reasons of failure are cut to this.
   integer, parameter :: reason_room = 200
   character(*), parameter :: plan_file = 'plan.txt'
   !> Room for what stands behind the last byte of a part.
   integer, parameter :: seal_length = 33
   !> The results file while it is put together.
   character(*), parameter :: assembled_file = 'assembled.h5'

   !> Some rows.
   type :: part_t
      !> Parameters, [axes, cases]
      real(wp), allocatable :: values(:, :)
      !> Measures, [measure_count, cases]
      real(wp), allocatable :: rows(:, :)
      !> Cases that failed, and why
      integer, allocatable :: failed(:)
      character(reason_room), allocatable :: reasons(:)
   end type part_t

contains

   !> Where the parts of a sweep are.
   pure function parts_folder(folder, name) result(path)
      !> Folder of the results
      character(*), intent(in) :: folder
      !> Name of the scene
      character(*), intent(in) :: name
      character(:), allocatable :: path

      path = folder//'/'//name//'.parts'
   end function parts_folder

   !> Make the folder of the parts, or go on with one that a run of the same plan left. Nobody else has it: the
   !> results file, which it stands for, is claimed.
   subroutine enter_folder(path, text, error)
      !> The folder
      character(*), intent(in) :: path
      !> The plan in words
      character(*), intent(in) :: text
      !> Set when the parts there belong to another plan, or what is there is not the program's
      type(failure_t), allocatable, intent(out) :: error

      character(*), parameter :: wanted = 'a folder of parts'
      character(:), allocatable :: present
      character(kind=c_char), allocatable :: bytes(:)
      character(entry_length), allocatable :: entries(:)
      integer :: i

      select case (kind_of(path))
      case (kind_nothing)
         call make_new_folder(path, error)
      case (kind_folder)
         if (kind_of(path//'/'//plan_file) == kind_nothing) then
            ! the plan is there before any part and goes after all: without it a killed run left nothing but it half
            call folder_entries(path, entries)
            do i = 1, size(entries)
               if (final_name(trim(entries(i))) /= plan_file) call refuse_foreign(path, wanted, error)
            end do
         else
            call load_file(path//'/'//plan_file, bytes, error)
            if (allocated(error)) return
            allocate (character(size(bytes)) :: present)
            present = transfer(bytes, present)
            if (index(present, program_name//' ') /= 1) then
               call refuse_foreign(path, wanted, error)
            else if (present /= text) then
               call fail(error, status_bad_input, "'"//path//"' holds the parts of another sweep: there "// &
                         difference(present, text)//'; let that one finish with the scene as it was, remove the ' &
                         //'folder, or give another name or --out')
            end if
            return
         end if
      case default
         call refuse_foreign(path, wanted, error)
      end select
      if (allocated(error)) return
      allocate (bytes(len(text)))
      bytes(:) = transfer(text, bytes)
      call replace_file(path, plan_file, bytes, error)
   end subroutine enter_folder

   !> Remove the parts, and the folder unless the user put something into it.
   subroutine leave_folder(path)
      !> The folder
      character(*), intent(in) :: path

      character(entry_length), allocatable :: entries(:)
      logical :: is_gone
      integer :: i

      call folder_entries(path, entries)
      entries = pack(entries, [(is_own(trim(entries(i))), i=1, size(entries))])
      call remove_entries(path, pack(entries, entries /= plan_file))
      call remove_entries(path, [plan_file])
      call remove_empty_folder(path, is_gone)
      if (.not. is_gone) write (error_unit, '(a)') &
         "impactbeam: '"//path//"' stays: it holds what impactbeam did not write"
   end subroutine leave_folder

   !> Is a file in the folder of the parts the program's, by its name?
   pure function is_own(name) result(answer)
      !> The name
      character(*), intent(in) :: name
      logical :: answer

      character(:), allocatable :: final

      final = final_name(name)
      answer = final == plan_file .or. final == assembled_file
      if (len(final) >= len(part_name(1)) .and. index(final, '.h5', back=.true.) == len(final) - 2) &
         answer = answer .or. verify(final(:len(final) - 3), '0123456789') == 0
   end function is_own

   !> The first line in which two texts differ.
   pure function difference(there, here) result(words)
      !> The text on disk
      character(*), intent(in) :: there
      !> The text of this run
      character(*), intent(in) :: here
      character(:), allocatable :: words

      integer :: i, start

      start = 1
      do i = 1, min(len(there), len(here))
         if (there(i:i) /= here(i:i)) exit
         if (there(i:i) == new_line('a')) start = i + 1
      end do
      words = "'"//line_at(there, start)//"', here '"//line_at(here, start)//"'"
   end function difference

   !> The line that begins at a place.
   pure function line_at(text, start) result(line)
      !> The text
      character(*), intent(in) :: text
      !> The place
      integer, intent(in) :: start
      character(:), allocatable :: line

      integer :: length

      line = text(min(start, len(text) + 1):)
      length = index(line, new_line('a'))
      if (length > 0) line = line(:length - 1)
   end function line_at

   !> The name of a part's file.
   pure function part_name(part) result(name)
      !> The part, from 1
      integer, intent(in) :: part
      character(:), allocatable :: name

      character(16) :: digits

      write (digits, '(i0.6)') part
      name = trim(digits)//'.h5'
   end function part_name

   !> Is a part on disk? It is there whole or not at all, but a disk may have spoilt it.
   function part_is_done(path, part) result(done)
      !> The folder
      character(*), intent(in) :: path
      !> The part
      integer, intent(in) :: part
      logical :: done

      done = kind_of(path//'/'//part_name(part)) /= kind_nothing
   end function part_is_done

   !> Write a part.
   subroutine write_part(path, plan, text, number, part, error)
      !> The folder
      character(*), intent(in) :: path
      !> The plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Number of the part
      integer, intent(in) :: number
      !> Its rows
      type(part_t), intent(in) :: part
      !> Why it could not be written
      type(failure_t), allocatable, intent(out) :: error

      integer(size_t), parameter :: overhead = 32768_size_t
      type(hdf5_group_t) :: root
      character(kind=c_char), allocatable :: bytes(:)
      character(seal_length, kind=c_char) :: mark
      integer :: i

      call root%begin(8_size_t*(size(part%rows, kind=size_t) + size(part%values, kind=size_t)) + overhead)
      call root%add('plan', real(checksum(text, len(text, kind=c_size_t)), wp), '1', 'checksum of the plan in plan.txt')
      call root%add('case', [(i, i=first_of_part(plan, number), last_of_part(plan, number))], '1', &
                     'number of the case', is_scale=.true.)
      call root%add('column', [(i, i=1, measure_count)], '1', 'number of the measure', is_scale=.true.)
      call root%note('names', joined(measure_table%name), 'column')
      call root%add('parameter', [(i, i=1, size(plan%axes))], '1', 'number of the parameter', is_scale=.true.)
      call root%note('names', joined(plan%axes%parameter%name), 'parameter')
      call root%add('parameters', part%values, 'mixed', 'parameters of each case', ['parameter', 'case     '])
      call root%add('rows', part%rows, 'mixed', 'measures of each case', ['column', 'case  '])
      call root%add('failed', part%failed, '1', 'cases that failed', is_scale=.true.)
      call root%add('reason', part%reasons, 'none', 'why', along='failed')
      call root%finish(bytes, error)
      if (allocated(error)) return
      mark = seal(checksum(bytes, size(bytes, kind=c_size_t)))
      call replace_file(path, part_name(number), [bytes, transfer(mark, bytes)], error)
   end subroutine write_part

   !> What stands behind the last byte of a part, where HDF5 does not look.
   pure function seal(sum) result(words)
      !> Checksum of the bytes before
      integer(i8), intent(in) :: sum
      character(seal_length) :: words

      write (words, '(a, z8.8, a)') new_line('a')//'impactbeam part CRC-32 ', sum, new_line('a')
   end function seal

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

   !> Read a part back.
   subroutine read_part(path, plan, text, number, part, is_good)
      !> The folder
      character(*), intent(in) :: path
      !> The plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Number of the part
      integer, intent(in) :: number
      !> Its rows
      type(part_t), intent(out) :: part
      !> False: it cannot be read, or belongs to another plan
      logical, intent(out) :: is_good

      integer(hid_t) :: file
      integer :: status, cases, failures, first
      character(kind=c_char), allocatable :: bytes(:)
      type(failure_t), allocatable :: error
      integer, allocatable, target :: failed(:), case(:)
      real(wp), allocatable, target :: values(:, :), rows(:, :)
      real(wp), target :: found(1)

      first = first_of_part(plan, number)
      cases = last_of_part(plan, number) - first + 1
      allocate (values(size(plan%axes), cases), rows(measure_count, cases), case(cases))
      call load_file(path//'/'//part_name(number), bytes, error)
      is_good = .not. allocated(error)
      if (is_good) call open_sealed(bytes, file, is_good)
      if (.not. is_good) return
      call load(file, 'plan', h5t_native_double, 1_hsize_t, c_loc(found), is_good)
      if (is_good) is_good = nint(found(1), i8) == checksum(text, len(text, kind=c_size_t))
      call load(file, 'case', h5t_native_integer, size(case, kind=hsize_t), c_loc(case), is_good)
      if (is_good) is_good = case(1) == first .and. case(cases) == first + cases - 1
      call load(file, 'parameters', h5t_native_double, size(values, kind=hsize_t), c_loc(values), is_good)
      call load(file, 'rows', h5t_native_double, size(rows, kind=hsize_t), c_loc(rows), is_good)
      failures = 0
      if (is_good) failures = count(rows(measure_status, :) > 0.0_wp)
      allocate (failed(failures), part%reasons(failures))
      if (failures > 0) then
         call load(file, 'failed', h5t_native_integer, int(failures, hsize_t), c_loc(failed), is_good)
         call load_reasons(file, part%reasons, is_good)
      end if
      call h5fclose_f(file, status)
      call move_alloc(values, part%values)
      call move_alloc(rows, part%rows)
      call move_alloc(failed, part%failed)
   end subroutine read_part

   !> Open a part that was loaded into memory, so that what HDF5 reads is what was checked, and is sound.
   subroutine open_sealed(bytes, file, is_good)
      !> The file and its seal
      character(kind=c_char), contiguous, target, intent(in) :: bytes(:)
      !> The file, open
      integer(hid_t), intent(out) :: file
      !> The seal fits, and the file is open
      logical, intent(out) :: is_good

      integer(size_t), parameter :: increment = 65536_size_t
      character(seal_length, kind=c_char) :: mark
      integer(hid_t) :: access
      integer(size_t) :: length
      integer :: status

      length = size(bytes, kind=size_t) - len(mark, kind=size_t)
      is_good = length > 0_size_t
      if (.not. is_good) return
      mark = transfer(bytes(length + 1_size_t:), mark)
      is_good = mark == seal(checksum(bytes, length))
      if (.not. is_good) return
      call open_hdf5(status)
      call h5pcreate_f(h5p_file_access_f, access, status)
      call h5pset_fapl_core_f(access, increment, .false., status)
      call h5pset_file_image_f(access, c_loc(bytes), length, status)
      call h5fopen_f('part', h5f_acc_rdonly_f, file, status, access)
      is_good = status == 0
      call h5pclose_f(access, status)
   end subroutine open_sealed

   !> Read a dataset of a known size.
   subroutine load(file, name, type, expected, address, is_good)
      !> The open file
      integer(hid_t), intent(in) :: file
      !> The dataset, and its type in memory
      character(*), intent(in) :: name
      integer(hid_t), intent(in) :: type
      !> Number of its elements
      integer(hsize_t), intent(in) :: expected
      !> Where they go
      type(c_ptr), intent(in) :: address
      !> In: go on. Out: it went well
      logical, intent(inout) :: is_good

      integer(hid_t) :: dataset, space
      integer(hsize_t) :: points
      integer :: status
      type(c_ptr) :: place

      if (.not. is_good) return
      call h5dopen_f(file, name, dataset, status)
      is_good = status == 0
      if (.not. is_good) return
      call h5dget_space_f(dataset, space, status)
      call h5sget_simple_extent_npoints_f(space, points, status)
      is_good = points == expected
      place = address
      if (is_good) call h5dread_f(dataset, type, place, status)
      is_good = is_good .and. status == 0
      call h5sclose_f(space, status)
      call h5dclose_f(dataset, status)
   end subroutine load

   !> Read the reasons.
   subroutine load_reasons(file, reasons, is_good)
      !> The open file
      integer(hid_t), intent(in) :: file
      !> The reasons
      character(*), intent(out) :: reasons(:)
      !> In: go on. Out: it went well
      logical, intent(inout) :: is_good

      integer(hid_t) :: type
      integer :: status, i, k
      type(c_ptr), target :: addresses(size(reasons))
      character(kind=c_char), pointer :: letters(:)

      reasons = ''
      call h5tcopy_f(h5t_string, type, status)
      call h5tset_cset_f(type, h5t_cset_utf8_f, status)
      call load(file, 'reason', type, size(reasons, kind=hsize_t), c_loc(addresses), is_good)
      call h5tclose_f(type, status)
      if (.not. is_good) return
      do i = 1, size(reasons)
         if (.not. c_associated(addresses(i))) cycle
         call c_f_pointer(addresses(i), letters, [len(reasons) + 1])
         do k = 1, len(reasons)
            if (letters(k) == c_null_char) exit
            reasons(i) (k:k) = letters(k)
         end do
         call c_free(addresses(i))
      end do
   end subroutine load_reasons

end module sweep_parts
