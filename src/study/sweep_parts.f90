!> The parts of a sweep on disk while it runs: files of some hundred rows each, written aside and renamed into place,
!> so that whatever ends the run each of them is whole or absent. Beside them lies the plan they belong to.
module sweep_parts
   use, intrinsic :: iso_c_binding, only: c_char, c_size_t
   use, intrinsic :: iso_fortran_env, only: error_unit
   use checksums, only: checksum
   use failures, only: fail, failure_t, status_bad_input
   use file_system, only: entry_length, final_name, folder_entries, kind_folder, kind_nothing, kind_of, load_file, &
      make_new_folder, remove_empty_folder, remove_entries, replace_file
   use hdf5_loading, only: hdf5_source_t
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: i8, wp
   use measure_list, only: measure_count, measure_status, measure_table
   use program_identity, only: program_name
   use results_claim, only: refuse_foreign
   use sweep_plan, only: first_of_part, last_of_part, plan_t, section_values
   implicit none (type, external)
   private
   public :: part_rows_t, parts_folder, enter_folder, leave_folder, part_is_done, part_name, write_part, read_part
   public :: joined, reason_room, assembled_file

   !> Reasons of failure are cut to this.
   integer, parameter :: reason_room = 200
   character(*), parameter :: plan_file = 'plan.txt'
   !> Room for what stands behind the last byte of a part.
   integer, parameter :: seal_length = 33
   !> The results file while it is put together.
   character(*), parameter :: assembled_file = 'assembled.h5'

   !> Some rows.
   type :: part_rows_t
      !> Parameters, [axes, cases]
      real(wp), allocatable :: values(:, :)
      !> Measures, [measure_count, cases]
      real(wp), allocatable :: rows(:, :)
      !> Cases that failed, and why
      integer, allocatable :: failed(:)
      character(reason_room), allocatable :: reasons(:)
      !> Sections as results have them, the last of a case last, NaN where there is none, [values, cases]
      real(wp), allocatable :: sections(:, :)
   end type part_rows_t

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
      character(*), intent(in) :: name
      logical :: answer

      character(:), allocatable :: final

      final = final_name(name)
      answer = final == plan_file .or. final == assembled_file
      if (len(final) >= len(part_name(1)) .and. index(final, '.h5', back=.true.) == len(final) - 2) then
         answer = answer .or. verify(final(:len(final) - 3), '0123456789') == 0
      end if
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
      character(*), intent(in) :: path
      integer, intent(in) :: part
      logical :: done

      done = kind_of(path//'/'//part_name(part)) /= kind_nothing
   end function part_is_done

   !> Write a part.
   subroutine write_part(path, plan, text, number, part, error)
      character(*), intent(in) :: path
      !> The plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Number of the part
      integer, intent(in) :: number
      type(part_rows_t), intent(in) :: part
      !> Why it could not be written
      type(failure_t), allocatable, intent(out) :: error

      integer(c_size_t), parameter :: overhead = 32768_c_size_t
      type(hdf5_group_t) :: root
      character(kind=c_char), allocatable :: bytes(:)
      character(seal_length, kind=c_char) :: mark
      integer :: i

      call root%begin(8_c_size_t*(size(part%rows, kind=c_size_t) + size(part%values, kind=c_size_t) &
         + int(section_values*plan%sections, c_size_t)*size(part%rows, 2, kind=c_size_t)) + overhead)
      call root%add('plan', real(checksum(text, len(text, kind=c_size_t)), wp), '1', 'checksum of the plan in plan.txt')
      call root%add('case', [(i, i=first_of_part(plan, number), last_of_part(plan, number))], '1', &
         'number of the case', is_scale=.true.)
      call root%add('column', [(i, i=1, measure_count)], '1', 'number of the measure', is_scale=.true.)
      call root%attribute('names', joined(measure_table%name), 'column')
      call root%add('parameter', [(i, i=1, size(plan%axes))], '1', 'number of the parameter', is_scale=.true.)
      call root%attribute('names', joined(plan%axes%parameter%name), 'parameter')
      call root%add('parameters', part%values, 'mixed', 'parameters of each case', ['parameter', 'case     '])
      call root%add('rows', part%rows, 'mixed', 'measures of each case', ['column', 'case  '])
      if (plan%sections > 0) then
         call root%add('section_value', [(i, i=1, size(part%sections, 1))], '1', 'values of sections', is_scale=.true.)
         call root%add('sections', part%sections, 'mixed', 'sections of each case', ['section_value', 'case         '])
      end if
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
      character(*), intent(in) :: path
      !> The plan, and the same in words
      type(plan_t), intent(in) :: plan
      character(*), intent(in) :: text
      !> Number of the part
      integer, intent(in) :: number
      type(part_rows_t), intent(out) :: part
      !> False: it cannot be read, or belongs to another plan
      logical, intent(out) :: is_good

      type(hdf5_source_t) :: source
      type(failure_t), allocatable :: error
      character(kind=c_char), allocatable :: bytes(:)
      integer, allocatable :: case(:)
      integer :: cases, failures, first
      real(wp) :: found(1)

      first = first_of_part(plan, number)
      cases = last_of_part(plan, number) - first + 1
      allocate (part%values(size(plan%axes), cases), part%rows(measure_count, cases), case(cases))
      allocate (part%sections(section_values*plan%sections, cases))
      call load_file(path//'/'//part_name(number), bytes, error)
      is_good = .not. allocated(error)
      if (is_good) is_good = is_sealed(bytes)
      if (.not. is_good) return
      ! what HDF5 reads is what was checked
      call source%open_bytes(bytes(:size(bytes) - seal_length))
      call source%load('plan', found)
      call source%load('case', case)
      call source%load('parameters', part%values)
      call source%load('rows', part%rows)
      if (plan%sections > 0) call source%load('sections', part%sections)
      is_good = source%is_sound()
      if (is_good) is_good = nint(found(1), i8) == checksum(text, len(text, kind=c_size_t)) &
         .and. case(1) == first .and. case(cases) == first + cases - 1
      failures = 0
      if (is_good) failures = count(part%rows(measure_status, :) > 0.0_wp)
      allocate (part%failed(failures), part%reasons(failures))
      call source%load('failed', part%failed)
      call source%load('reason', part%reasons)
      is_good = is_good .and. source%is_sound()
      call source%close_source()
   end subroutine read_part

   !> Does the seal of a part fit its bytes?
   function is_sealed(bytes) result(fits)
      !> The file and its seal
      character(kind=c_char), contiguous, intent(in) :: bytes(:)
      logical :: fits

      character(seal_length, kind=c_char) :: mark
      integer(c_size_t) :: length

      length = size(bytes, kind=c_size_t) - len(mark, kind=c_size_t)
      fits = length > 0_c_size_t
      if (.not. fits) return
      mark = transfer(bytes(length + 1_c_size_t:), mark)
      fits = mark == seal(checksum(bytes, length))
   end function is_sealed

end module sweep_parts
