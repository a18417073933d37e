!> Folders and files. A file is written under a temporary name and renamed when it is complete, so it appears under its
!> name either complete or not at all.
module file_system
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_null_char, c_ptr, c_size_t
   use failures, only: fail, failure_t, status_run_failed
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: make_folder, test_folder, make_new_folder, existing_part, remove_empty_folder, remove_empty_folders, &
      folder_entries, remove_entries, entry_length, kind_of, kind_nothing, kind_file, kind_folder, kind_link, &
      load_file, problem_with_reading, replace_file, move_file, reason, partial_name, final_name, path_beside, &
      is_terminal, standard_error_descriptor, load_text

   !> Maximum size in bytes of a file that is read, far beyond any scene.
   integer, parameter :: max_file_size = 2**25
   !> Byte order mark, with which some editors start a UTF-8 file
   character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)

   !> File descriptor of standard error.
   integer(c_int), parameter :: standard_error_descriptor = 2_c_int

   !> Mark between the name of an incomplete file and the number of the process that writes the file.
   character(*), parameter :: partial_mark = '.part-'
   !> Maximum length of a name in a folder.
   integer, parameter :: entry_length = 255

   !> Kinds of entries that a path can name. Other kinds have other numbers.
   integer, parameter :: kind_nothing = 0
   integer, parameter :: kind_file = 1
   integer, parameter :: kind_folder = 2
   integer, parameter :: kind_link = 3

   abstract interface
      !> A function of the entry that a path names.
      function path_function_t(path) bind(c) result(code)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: code
      end function path_function_t
   end interface

   !> POSIX: remove a file.
   procedure(path_function_t), bind(c, name='unlink') :: posix_unlink
   ! functions that are documented in file_system_posix.c
   procedure(path_function_t), bind(c) :: impactbeam_kind_of, impactbeam_make_folder, impactbeam_make_new_folder, &
      impactbeam_remove_empty_folder

   interface
      !> POSIX: the number of this process.
      function posix_getpid() bind(c, name='getpid') result(process)
         import :: c_int
         implicit none (type, external)
         integer(c_int) :: process
      end function posix_getpid

      !> POSIX: whether the descriptor is a terminal.
      function posix_isatty(descriptor) bind(c, name='isatty') result(answer)
         import :: c_int
         implicit none (type, external)
         integer(c_int), value :: descriptor
         integer(c_int) :: answer
      end function posix_isatty

      ! The following functions are documented in file_system_posix.c.
      function impactbeam_write_bytes(path, bytes, count) bind(c) result(code)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: count
         integer(c_int) :: code
      end function impactbeam_write_bytes

      function impactbeam_rename(from, to) bind(c) result(code)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: from(*)
         character(kind=c_char), intent(in) :: to(*)
         integer(c_int) :: code
      end function impactbeam_rename

      function impactbeam_read_bytes(path, follow_links, bytes, count) bind(c) result(code)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: follow_links
         character(kind=c_char), intent(inout), optional :: bytes(*)
         integer(c_size_t), intent(inout) :: count
         integer(c_int) :: code
      end function impactbeam_read_bytes

      function impactbeam_open_folder(path) bind(c) result(entries)
         import :: c_char, c_ptr
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr) :: entries
      end function impactbeam_open_folder

      function impactbeam_next_entry(entries, name, size) bind(c) result(is_there)
         import :: c_char, c_int, c_ptr, c_size_t
         implicit none (type, external)
         type(c_ptr), value :: entries
         character(kind=c_char), intent(out) :: name(*)
         integer(c_size_t), value :: size
         integer(c_int) :: is_there
      end function impactbeam_next_entry

      subroutine impactbeam_remove_entry(entries, name) bind(c)
         import :: c_char, c_ptr
         implicit none (type, external)
         type(c_ptr), value :: entries
         character(kind=c_char), intent(in) :: name(*)
      end subroutine impactbeam_remove_entry

      subroutine impactbeam_close_folder(entries) bind(c)
         import :: c_ptr
         implicit none (type, external)
         type(c_ptr), value :: entries
      end subroutine impactbeam_close_folder

      subroutine impactbeam_remove_leftovers(folder, prefix) bind(c)
         import :: c_char
         implicit none (type, external)
         character(kind=c_char), intent(in) :: folder(*)
         character(kind=c_char), intent(in) :: prefix(*)
      end subroutine impactbeam_remove_leftovers

      subroutine impactbeam_describe(code, text, size) bind(c)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         integer(c_int), value :: code
         character(kind=c_char), intent(out) :: text(*)
         integer(c_size_t), value :: size
      end subroutine impactbeam_describe
   end interface

contains

   !> Make a folder and its parents unless they exist.
   subroutine make_folder(path, error)
      character(*), intent(in) :: path
      !> Reason why the folder could not be made
      type(failure_t), allocatable, intent(out) :: error

      integer(c_int) :: code

      code = impactbeam_make_folder(trim(path)//c_null_char)
      if (code /= 0) call fail(error, status_run_failed, "cannot make the folder '"//trim(path)//"': "//reason(code))
   end subroutine make_folder

   !> Test that a file can be written in a folder. A folder that exists may refuse files: on a full disk, on a read-only
   !> file system, or without permission.
   subroutine test_folder(path, error)
      character(*), intent(in) :: path
      !> Reason why the folder refuses files
      type(failure_t), allocatable, intent(out) :: error

      ! name and content of the file that is written to test the folder and removed at once
      character(*), parameter :: trial = 'trial'
      character(*), parameter :: block = repeat(' ', 4096)
      character(:), allocatable :: partial
      integer(c_int) :: code, ignored

      call impactbeam_remove_leftovers(trim(path)//c_null_char, partial_prefix(trial)//c_null_char)
      partial = trim(path)//'/'//partial_name(trial, posix_getpid())//c_null_char
      code = impactbeam_write_bytes(partial, block, len(block, kind=c_size_t))
      ignored = posix_unlink(partial)
      if (code /= 0) call fail(error, status_run_failed, "cannot write in the folder '"//trim(path)//"': "// &
         reason(code))
   end subroutine test_folder

   !> Leading part of the path of a folder that exists; empty: nothing of it.
   function existing_part(path) result(part)
      character(*), intent(in) :: path
      character(:), allocatable :: part

      part = trim(path)
      do while (part /= '')
         if (kind_of(part) /= kind_nothing) return
         part = part(:index(part, '/', back=.true.) - 1)
      end do
   end function existing_part

   !> Remove a folder and its parents if they are empty, up to a leading part of its path, which remains.
   subroutine remove_empty_folders(path, part)
      character(*), intent(in) :: path
      !> Leading part of the path, as `existing_part` found it before the folder was made
      character(*), intent(in) :: part

      character(:), allocatable :: folder
      logical :: is_gone

      folder = trim(path)
      do
         ! a path may end in slashes, and a folder is removed once
         folder = folder(:verify(folder, '/', back=.true.))
         if (len(folder) <= len(part)) return
         call remove_empty_folder(folder, is_gone)
         if (.not. is_gone) return
         folder = folder(:index(folder, '/', back=.true.))
      end do
   end subroutine remove_empty_folders

   !> Write bytes to a file in an existing folder. The bytes are written to a temporary file, which replaces the old
   !> file when it is complete, so the old file survives any failure.
   subroutine replace_file(folder, name, bytes, error)
      character(*), intent(in) :: folder
      !> Name of the file in the folder
      character(*), intent(in) :: name
      !> Content of the file
      character(*), intent(in) :: bytes
      !> Reason why the file could not be written
      type(failure_t), allocatable, intent(out) :: error

      character(:), allocatable :: path, partial
      integer(c_int) :: code

      path = trim(folder)//'/'//trim(name)
      partial = trim(folder)//'/'//partial_name(name, posix_getpid())
      call impactbeam_remove_leftovers(trim(folder)//c_null_char, partial_prefix(name)//c_null_char)
      code = impactbeam_write_bytes(partial//c_null_char, bytes, len(bytes, kind=c_size_t))
      if (code == 0) code = impactbeam_rename(partial//c_null_char, path//c_null_char)
      if (code == 0) return
      call fail(error, status_run_failed, "cannot write '"//path//"': "//reason(code))
      ! A failure of unlink is ignored because the next run removes the temporary file.
      code = posix_unlink(partial//c_null_char)
   end subroutine replace_file

   !> Rename a file on the same disk and replace an existing file of the new name.
   subroutine move_file(from, to, error)
      character(*), intent(in) :: from
      character(*), intent(in) :: to
      !> Reason why the file could not be renamed
      type(failure_t), allocatable, intent(out) :: error

      integer(c_int) :: code

      code = impactbeam_rename(trim(from)//c_null_char, trim(to)//c_null_char)
      if (code /= 0) call fail(error, status_run_failed, "cannot write '"//trim(to)//"': "//reason(code))
   end subroutine move_file

   !> Make a folder that does not exist, in an existing folder.
   subroutine make_new_folder(path, error)
      character(*), intent(in) :: path
      !> Reason why the folder could not be made
      type(failure_t), allocatable, intent(inout) :: error

      integer(c_int) :: code

      code = impactbeam_make_new_folder(trim(path)//c_null_char)
      if (code /= 0) call fail(error, status_run_failed, "cannot make the folder '"//trim(path)//"': "//reason(code))
   end subroutine make_new_folder

   !> Remove a folder if it is empty.
   subroutine remove_empty_folder(path, is_gone)
      character(*), intent(in) :: path
      !> Whether the folder was removed
      logical, intent(out) :: is_gone

      is_gone = impactbeam_remove_empty_folder(trim(path)//c_null_char) == 0
   end subroutine remove_empty_folder

   !> Kind of the entry that a path names. Links are not followed.
   integer function kind_of(path) result(kind)
      character(*), intent(in) :: path

      kind = impactbeam_kind_of(trim(path)//c_null_char)
   end function kind_of

   !> List the entries of a folder. The list is empty if the folder cannot be read or is a link.
   subroutine folder_entries(path, entries)
      character(*), intent(in) :: path
      !> Names of the entries, unordered
      character(entry_length), allocatable, intent(out) :: entries(:)

      character(entry_length), allocatable :: longer(:)
      character(entry_length + 1, kind=c_char) :: name
      integer :: count
      type(c_ptr) :: folder

      allocate (entries(16))
      count = 0
      folder = impactbeam_open_folder(trim(path)//c_null_char)
      do while (c_associated(folder))
         if (impactbeam_next_entry(folder, name, len(name, kind=c_size_t)) == 0) exit
         if (count == size(entries)) then
            allocate (longer(2*count))
            longer(:count) = entries
            call move_alloc(longer, entries)
         end if
         count = count + 1
         entries(count) = name(:index(name, c_null_char) - 1)
      end do
      if (c_associated(folder)) call impactbeam_close_folder(folder)
      entries = entries(:count)
   end subroutine folder_entries

   !> Remove files of a folder that is not a link. Subfolders remain.
   subroutine remove_entries(path, entries)
      character(*), intent(in) :: path
      !> Names of the files in the folder
      character(*), intent(in) :: entries(:)

      integer :: i
      type(c_ptr) :: folder

      folder = impactbeam_open_folder(trim(path)//c_null_char)
      if (.not. c_associated(folder)) return
      do i = 1, size(entries)
         call impactbeam_remove_entry(folder, trim(entries(i))//c_null_char)
      end do
      call impactbeam_close_folder(folder)
   end subroutine remove_entries

   !> Load a file that the program wrote. Links are not followed.
   subroutine load_file(path, bytes, error)
      character(*), intent(in) :: path
      !> Content of the file
      character(:), allocatable, intent(out) :: bytes
      !> Reason why the file could not be read
      type(failure_t), allocatable, intent(out) :: error

      character(:), allocatable :: problem

      call load_bytes(path, .false., huge(0), bytes, problem)
      if (allocated(problem)) call fail(error, status_run_failed, "cannot read '"//trim(path)//"': "//problem)
   end subroutine load_file

   !> Load a regular file. Pipes and devices are refused so that the call never waits.
   subroutine load_bytes(path, follow_links, max_length, bytes, problem)
      character(*), intent(in) :: path
      !> Whether links are followed
      logical, intent(in) :: follow_links
      !> Maximum size of the file in bytes
      integer, intent(in) :: max_length
      !> Content of the file
      character(:), allocatable, intent(out) :: bytes
      !> Reason why the file could not be read; unallocated: the file was read
      character(:), allocatable, intent(out) :: problem

      integer(c_int) :: code, follow
      integer(c_size_t) :: count

      follow = merge(1_c_int, 0_c_int, follow_links)
      count = 0_c_size_t
      code = impactbeam_read_bytes(trim(path)//c_null_char, follow, count=count)
      if (code == 0 .and. count > int(max_length, c_size_t)) then
         problem = 'it is too long: at most '//to_text(max_length)//' bytes are read'
         count = 0_c_size_t
      end if
      allocate (character(count) :: bytes)
      if (code == 0 .and. count > 0_c_size_t) then
         code = impactbeam_read_bytes(trim(path)//c_null_char, follow, bytes, count)
      end if
      if (code /= 0) problem = reason(code)
   end subroutine load_bytes

   !> Reason why a regular file cannot be opened for reading; empty: it can be. Links are not followed.
   function problem_with_reading(path) result(words)
      character(*), intent(in) :: path
      character(:), allocatable :: words

      integer(c_int) :: code
      integer(c_size_t) :: count

      count = 0_c_size_t
      code = impactbeam_read_bytes(trim(path)//c_null_char, 0_c_int, count=count)
      words = ''
      if (code /= 0) words = reason(code)
   end function problem_with_reading

   !> Temporary name of an incomplete file: hidden, and without the extension of a results file.
   pure function partial_name(name, process) result(partial)
      !> Final name of the file
      character(*), intent(in) :: name
      !> Number of the process
      integer, intent(in) :: process
      character(:), allocatable :: partial

      character(12) :: digits

      write (digits, '(i0)') process
      partial = partial_prefix(name)//trim(digits)
   end function partial_name

   !> Final name of a file from its temporary name. Any other name is returned unchanged.
   pure function final_name(name) result(final)
      character(*), intent(in) :: name
      character(:), allocatable :: final

      integer :: mark_start

      final = name
      mark_start = index(name, partial_mark, back=.true.)
      if (index(name, '.') /= 1 .or. mark_start <= 2) return
      if (verify(name(mark_start + len(partial_mark):), '0123456789') == 0) final = name(2:mark_start - 1)
   end function final_name

   !> Path of a file that is named relative to the folder of another file.
   pure function path_beside(file, name) result(path)
      !> Path of the other file
      character(*), intent(in) :: file
      !> Name, relative or absolute
      character(*), intent(in) :: name
      character(:), allocatable :: path

      path = name
      if (index(name, '/') /= 1) path = file(:index(file, '/', back=.true.))//name
   end function path_beside

   !> Start of the temporary names of a file.
   pure function partial_prefix(name) result(prefix)
      !> Final name of the file
      character(*), intent(in) :: name
      character(:), allocatable :: prefix

      prefix = '.'//trim(name)//partial_mark
   end function partial_prefix

   !> Whether a file descriptor is a terminal.
   logical function is_terminal(descriptor) result(answer)
      !> A file descriptor, such as `standard_error_descriptor`
      integer(c_int), intent(in) :: descriptor

      answer = posix_isatty(descriptor) == 1
   end function is_terminal

   !> Description of an error code by the operating system.
   function reason(code) result(words)
      integer(c_int), intent(in) :: code
      character(:), allocatable :: words

      integer, parameter :: max_length = 200
      character(max_length, kind=c_char) :: text

      call impactbeam_describe(code, text, int(max_length, c_size_t))
      words = text(:index(text, c_null_char) - 1)
   end function reason

   !> Read a regular file, or the file to which a link leads. A byte order mark at its beginning is left out.
   subroutine load_text(file, text, problem)
      character(*), intent(in) :: file
      !> Content of the file
      character(:), allocatable, intent(out) :: text
      !> Reason of a failure; unallocated: the file was read
      character(:), allocatable, intent(out) :: problem

      logical :: is_there, is_directory

      if (len_trim(file) == 0) then
         problem = 'no file name'
         return
      end if
      ! only a directory contains '.'
      inquire (file=trim(file)//'/.', exist=is_directory)
      inquire (file=file, exist=is_there)
      if (is_directory) then
         problem = 'is a directory, not a text file'
         return
      else if (.not. is_there) then
         problem = 'no such file'
         return
      end if

      call load_bytes(file, follow_links=.true., max_length=max_file_size, bytes=text, problem=problem)
      if (allocated(problem)) then
         problem = 'cannot be read: '//problem
         return
      end if
      if (index(text, byte_order_mark) == 1) text = text(len(byte_order_mark) + 1:)
      if (len(text) == 0) then
         problem = 'the file is empty'
      else if (index(text, achar(0)) > 0) then
         problem = 'is not a text file'
      end if
   end subroutine load_text

end module file_system
