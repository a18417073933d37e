!> The chunks of a sweep: files with the results of some hundred cases each (one row of parameters and measures for each
!> case), which a running sweep stores until the results file is assembled. Each file is written under a temporary name
!> and then renamed, so that it is complete or absent, however the run ends. The folder of the chunks also has the text
!> of the plan of the sweep (`sweep_plan`).
module sweep_chunks
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_c_binding, only: c_size_t
   use, intrinsic :: iso_fortran_env, only: error_unit
   use checksums, only: checksum
   use failures, only: fail, failure_t, status_bad_input, status_run_failed
   use file_system, only: entry_length, final_name, folder_entries, kind_folder, kind_nothing, kind_of, load_file, &
      make_new_folder, remove_empty_folder, remove_entries, replace_file
   use hdf5_loading, only: hdf5_source_t
   use hdf5_writing, only: hdf5_group_t
   use kinds, only: i8, wp
   use measure_list, only: measure_count, measure_status, measure_table
   use printable_text, only: joined
   use program_identity, only: program_name
   use results_claim, only: refuse_foreign
   use sweep_plan, only: first_of_chunk, last_of_chunk, plan_t
   implicit none (type, external)
   private
   public :: chunk_rows_t, open_chunk_folder, remove_chunk_folder, chunk_is_done, chunk_name, &
      write_chunk, read_chunk, load_chunk, load_chunks
   public :: max_reason_length, assembled_file

   !> Maximum length of the reason of a failure; longer texts are cut.
   integer, parameter :: max_reason_length = 200
   !> Name of the file with the text of the plan.
   character(*), parameter :: plan_file = 'plan.txt'
   !> Length of the seal, a text with a checksum that follows the last byte of a chunk.
   integer, parameter :: seal_length = 33
   !> Name of the results file while it is assembled.
   character(*), parameter :: assembled_file = 'assembled.h5'

   !> The results of the cases of a chunk.
   type :: chunk_rows_t
      !> Parameters, [axes, cases]
      real(wp), allocatable :: values(:, :)
      !> Measures, [measure_count, cases]
      real(wp), allocatable :: rows(:, :)
      !> Numbers of the cases that failed
      integer, allocatable :: failed(:)
      !> Reasons of their failures
      character(max_reason_length), allocatable :: reasons(:)
      !> Further values of each case, [plan%extras, cases]: Poincare sections in the units of the results, the values of
      !> one section after the other, preceded by NaN if there are fewer than requested, then spectra; or what the plan
      !> computes instead of a run
      real(wp), allocatable :: extras(:, :)
   end type chunk_rows_t

contains

   !> Create the folder of the chunks, or continue with the folder that a run of the same plan has left. No other run
   !> uses the folder, because the name of the results file is reserved for this run.
   subroutine open_chunk_folder(path, text, error)
      character(*), intent(in) :: path
      !> Text of the plan
      character(*), intent(in) :: text
      !> Set if there are chunks and they belong to another plan, or if another program has written the folder
      type(failure_t), allocatable, intent(out) :: error

      character(*), parameter :: wanted = 'a folder of parts'
      character(:), allocatable :: stored_plan
      character(entry_length), allocatable :: entries(:)
      integer :: i
      logical :: is_gone

      select case (kind_of(path))
      case (kind_nothing)
         call make_new_folder(path, error)
      case (kind_folder)
         if (kind_of(path//'/'//plan_file) == kind_nothing) then
            ! the plan is written before the first and removed after the last chunk, so that without a plan the folder
            ! can contain only an incomplete plan of a killed run
            call folder_entries(path, entries)
            do i = 1, size(entries)
               if (final_name(trim(entries(i))) /= plan_file) call refuse_foreign(path, wanted, error)
            end do
         else
            call load_file(path//'/'//plan_file, stored_plan, error)
            if (allocated(error)) return
            call folder_entries(path, entries)
            if (index(stored_plan, program_name//' ') /= 1) then
               call refuse_foreign(path, wanted, error)
            else if (stored_plan /= text .and. any([(is_chunk_name(trim(entries(i))), i=1, size(entries))])) then
               call fail(error, status_bad_input, "'"//path//"' holds the parts of another sweep: there "// &
                  difference(stored_plan, text)//'; let that one finish with the scene as it was, remove the ' &
                  //'folder, or give another name or --out')
            end if
            ! the plan of a sweep that ended before its first part is replaced
            if (stored_plan == text) return
         end if
      case default
         call refuse_foreign(path, wanted, error)
      end select
      if (allocated(error)) return
      call replace_file(path, plan_file, text, error)
      if (allocated(error)) call remove_empty_folder(path, is_gone)
   end subroutine open_chunk_folder

   !> Remove the chunks, and the folder unless it has files of the user.
   subroutine remove_chunk_folder(path)
      character(*), intent(in) :: path

      character(entry_length), allocatable :: entries(:)
      logical :: is_gone
      integer :: i

      call folder_entries(path, entries)
      entries = pack(entries, [(is_own_file(trim(entries(i))), i=1, size(entries))])
      call remove_entries(path, pack(entries, entries /= plan_file))
      call remove_entries(path, [plan_file])
      call remove_empty_folder(path, is_gone)
      if (.not. is_gone) write (error_unit, '(a)') &
         "impactbeam: '"//path//"' stays: it holds what impactbeam did not write"
   end subroutine remove_chunk_folder

   !> Whether a file in the folder of the chunks has a name that the program uses.
   pure logical function is_own_file(name) result(answer)
      character(*), intent(in) :: name

      character(:), allocatable :: final

      final = final_name(name)
      answer = final == plan_file .or. final == assembled_file .or. is_chunk_name(final)
   end function is_own_file

   !> Whether a name is that of the file of a chunk.
   pure logical function is_chunk_name(name) result(answer)
      character(*), intent(in) :: name

      answer = len(name) >= len(chunk_name(1)) .and. index(name, '.h5', back=.true.) == len(name) - 2
      if (answer) answer = verify(name(:len(name) - 3), '0123456789') == 0
   end function is_chunk_name

   !> Both versions of the first line in which two texts differ, for messages.
   pure function difference(stored_text, current_text) result(words)
      !> Text on disk
      character(*), intent(in) :: stored_text
      !> Text of this run
      character(*), intent(in) :: current_text
      character(:), allocatable :: words

      integer :: i, start

      start = 1
      do i = 1, min(len(stored_text), len(current_text))
         if (stored_text(i:i) /= current_text(i:i)) exit
         if (stored_text(i:i) == new_line('a')) start = i + 1
      end do
      words = "'"//line_at(stored_text, start)//"', here '"//line_at(current_text, start)//"'"
   end function difference

   !> The line of a text that begins at a given position.
   pure function line_at(text, start) result(line)
      character(*), intent(in) :: text
      !> Position of the first character
      integer, intent(in) :: start
      character(:), allocatable :: line

      integer :: length

      line = text(min(start, len(text) + 1):)
      length = index(line, new_line('a'))
      if (length > 0) line = line(:length - 1)
   end function line_at

   !> The name of the file of a chunk.
   pure function chunk_name(chunk) result(name)
      !> Number of the chunk, from 1
      integer, intent(in) :: chunk
      character(:), allocatable :: name

      character(16) :: digits

      write (digits, '(i0.6)') chunk
      name = trim(digits)//'.h5'
   end function chunk_name

   !> Whether the file of a chunk is on disk. The file is complete, but the disk may have corrupted it.
   logical function chunk_is_done(path, chunk) result(done)
      character(*), intent(in) :: path
      integer, intent(in) :: chunk

      done = kind_of(path//'/'//chunk_name(chunk)) /= kind_nothing
   end function chunk_is_done

   !> Write a chunk.
   subroutine write_chunk(plan, number, chunk, error)
      type(plan_t), intent(in) :: plan
      !> Number of the chunk
      integer, intent(in) :: number
      type(chunk_rows_t), intent(in) :: chunk
      !> Set if the chunk cannot be written
      type(failure_t), allocatable, intent(out) :: error

      ! space for attributes and the structure of the HDF5 file, bytes
      integer(c_size_t), parameter :: overhead = 32768_c_size_t
      type(hdf5_group_t) :: root
      character(:), allocatable :: bytes
      integer, allocatable :: columns(:)
      logical :: is_stored(measure_count)
      integer :: i

      ! measures that no case has, such as those of groups that the scene does not have, are not stored
      is_stored = .not. all(ieee_is_nan(chunk%rows), dim=2)
      columns = pack([(i, i=1, measure_count)], is_stored)
      call root%begin(8_c_size_t*(size(chunk%rows, kind=c_size_t) + size(chunk%values, kind=c_size_t) &
         + int(plan%extras, c_size_t)*size(chunk%rows, 2, kind=c_size_t)) + overhead)
      call root%add('plan', real(checksum(plan%text), wp), '1', &
         'checksum of the plan in plan.txt')
      call root%add('case', [(i, i=first_of_chunk(plan, number), last_of_chunk(plan, number))], '1', &
         'number of the case', is_scale=.true.)
      call root%add('is_stored', merge(1, 0, is_stored), '1', '1: the measure is in rows; 0: it is NaN in all cases', &
         is_scale=.true.)
      call root%add('column', columns, '1', 'number of the measure', is_scale=.true.)
      call root%attribute('names', joined(measure_table(columns)%name, ', '), 'column')
      call root%add('parameter', [(i, i=1, size(plan%axes))], '1', 'number of the parameter', is_scale=.true.)
      call root%attribute('names', joined(plan%axes%parameter%name, ', '), 'parameter')
      call root%add('parameters', chunk%values, 'mixed', 'parameters of each case', 'parameter case')
      call root%add('rows', chunk%rows(columns, :), 'mixed', 'measures of each case', 'column case')
      if (plan%extras > 0) then
         call root%add('extra', [(i, i=1, plan%extras)], '1', 'numbers besides the measures', is_scale=.true.)
         call root%add('extras', chunk%extras, 'mixed', 'numbers besides the measures of each case', 'extra case')
      end if
      call root%add('failed', chunk%failed, '1', 'cases that failed', is_scale=.true.)
      call root%add('reason', chunk%reasons, 'none', 'why', along='failed')
      call root%finish(bytes, error)
      if (allocated(error)) return
      call replace_file(plan%path, chunk_name(number), bytes//seal(checksum(bytes)), error)
   end subroutine write_chunk

   !> The seal of a chunk, a text with a checksum that follows the last byte of the HDF5 file and that HDF5 does not
   !> read.
   pure function seal(sum) result(words)
      !> Checksum of the bytes of the HDF5 file
      integer(i8), intent(in) :: sum
      character(seal_length) :: words

      write (words, '(a, z8.8, a)') new_line('a')//'impactbeam part CRC-32 ', sum, new_line('a')
   end function seal

   !> Read a chunk.
   subroutine read_chunk(plan, number, chunk, is_good)
      type(plan_t), intent(in) :: plan
      !> Number of the chunk
      integer, intent(in) :: number
      type(chunk_rows_t), intent(out) :: chunk
      !> False: the chunk cannot be read, is damaged, or belongs to another plan
      logical, intent(out) :: is_good

      type(hdf5_source_t) :: source
      type(failure_t), allocatable :: error
      character(:), allocatable :: bytes
      integer(c_size_t) :: length
      real(wp), allocatable :: rows(:, :)
      integer, allocatable :: case(:)
      integer :: cases, failures, first, i, is_stored(measure_count)
      real(wp) :: found(1)

      first = first_of_chunk(plan, number)
      cases = last_of_chunk(plan, number) - first + 1
      allocate (chunk%values(size(plan%axes), cases), chunk%rows(measure_count, cases), case(cases))
      allocate (chunk%extras(plan%extras, cases))
      call load_file(plan%path//'/'//chunk_name(number), bytes, error)
      ! the checksum in the seal must be that of the bytes before it
      is_good = .false.
      if (allocated(error)) return
      length = len(bytes, kind=c_size_t) - int(seal_length, c_size_t)
      if (length <= 0_c_size_t) return
      is_good = bytes(length + 1_c_size_t:) == seal(checksum(bytes(:length)))
      if (.not. is_good) return
      ! HDF5 reads the same bytes that were checked, not the file again
      call source%open_bytes(bytes(:length))
      call source%load('plan', found)
      call source%load('case', case)
      call source%load('parameters', chunk%values)
      is_stored = 0
      call source%load('is_stored', is_stored)
      allocate (rows(count(is_stored == 1), cases))
      call source%load('rows', rows)
      chunk%rows = ieee_value(1.0_wp, ieee_quiet_nan)
      chunk%rows(pack([(i, i=1, measure_count)], is_stored == 1), :) = rows
      if (plan%extras > 0) call source%load('extras', chunk%extras)
      is_good = source%is_sound()
      if (is_good) is_good = nint(found(1), i8) == checksum(plan%text) &
         .and. case(1) == first .and. case(cases) == first + cases - 1
      failures = 0
      if (is_good) failures = count(chunk%rows(measure_status, :) > 0.0_wp)
      allocate (chunk%failed(failures), chunk%reasons(failures))
      call source%load('failed', chunk%failed)
      call source%load('reason', chunk%reasons)
      is_good = is_good .and. source%is_sound()
      call source%close_source()
   end subroutine read_chunk

   !> Read a chunk, which must be on disk.
   subroutine load_chunk(plan, number, chunk, error)
      type(plan_t), intent(in) :: plan
      !> Number of the chunk
      integer, intent(in) :: number
      type(chunk_rows_t), intent(out) :: chunk
      !> Set if the chunk cannot be read
      type(failure_t), allocatable, intent(out) :: error

      logical :: is_good

      call read_chunk(plan, number, chunk, is_good)
      if (.not. is_good) call fail(error, status_run_failed, "'"//plan%path//'/'//chunk_name(number)//"' is damaged " &
         //'(its checksum is wrong); give the same command again, and its cases are computed again')
   end subroutine load_chunk

   !> Read all chunks, and join their cases.
   subroutine load_chunks(plan, all_cases, error)
      type(plan_t), intent(in) :: plan
      type(chunk_rows_t), intent(out) :: all_cases
      !> Set if a chunk cannot be read
      type(failure_t), allocatable, intent(out) :: error

      type(chunk_rows_t) :: chunk
      integer :: number

      allocate (all_cases%values(size(plan%axes), plan%cases), all_cases%rows(measure_count, plan%cases), &
         all_cases%extras(plan%extras, plan%cases), all_cases%failed(0), all_cases%reasons(0))
      do number = 1, plan%chunks
         call load_chunk(plan, number, chunk, error)
         if (allocated(error)) return
         associate (first => first_of_chunk(plan, number), last => last_of_chunk(plan, number))
            all_cases%values(:, first:last) = chunk%values
            all_cases%rows(:, first:last) = chunk%rows
            all_cases%extras(:, first:last) = chunk%extras
         end associate
         all_cases%failed = [all_cases%failed, chunk%failed]
         all_cases%reasons = [all_cases%reasons, chunk%reasons]
      end do
   end subroutine load_chunks

end module sweep_chunks
