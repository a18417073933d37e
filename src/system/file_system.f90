!> Folders and files: a file appears under its name whole or not at all.
module file_system
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_null_char, c_ptr, c_size_t
   use failures, only: fail, failure_t, status_run_failed
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: make_folder, make_new_folder, remove_empty_folder, folder_entries, remove_entries, entry_length
   public :: kind_of, kind_nothing, kind_file, kind_folder, kind_link
   public :: load_file, load_bytes, replace_file, move_file, partial_name, final_name, reason
   public :: is_terminal, standard_error_descriptor

   !> File descriptor of standard error.
   integer(c_int), parameter :: standard_error_descriptor = 2_c_int

   !> Between the name of an incomplete file and the number of the process that writes it.
   character(*), parameter :: part_mark = '.part-'
   !> Longest name in a folder.
   integer, parameter :: entry_length = 255

   !> What can have a name; there are others.
   integer, parameter :: kind_nothing = 0
   integer, parameter :: kind_file = 1
   integer, parameter :: kind_folder = 2
   integer, parameter :: kind_link = 3

   interface
      !> POSIX: the number of this process.
      function posix_getpid() bind(c, name='getpid') result(process)
         import :: c_int
         implicit none (type, external)
         integer(c_int) :: process
      end function posix_getpid

      !> POSIX: is the descriptor a terminal?
      function posix_isatty(descriptor) bind(c, name='isatty') result(answer)
         import :: c_int
         implicit none (type, external)
         integer(c_int), value :: descriptor
         integer(c_int) :: answer
      end function posix_isatty

      !> POSIX: remove a file.
      function posix_unlink(path) bind(c, name='unlink') result(status)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: status
      end function posix_unlink

      ! The rest is explained in file_system_posix.c.
      function impactbeam_make_folder(path) bind(c) result(code)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: code
      end function impactbeam_make_folder

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

      function impactbeam_make_new_folder(path) bind(c) result(code)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: code
      end function impactbeam_make_new_folder

      function impactbeam_remove_empty_folder(path) bind(c) result(code)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: code
      end function impactbeam_remove_empty_folder

      function impactbeam_kind_of(path) bind(c) result(kind)
         import :: c_char, c_int
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: kind
      end function impactbeam_kind_of

      function impactbeam_read_bytes(path, follows_links, bytes, count) bind(c) result(code)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: follows_links
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

   !> Make a folder and those above it, unless it is there, and try whether a file can be written in it: one that can be
   !> made is not yet one that takes files, on a full disk, one mounted for reading, or where somebody else is the
   !> owner.
   subroutine make_folder(path, error)
      character(*), intent(in) :: path
      !> Why it could not be made or takes no file
      type(failure_t), allocatable, intent(out) :: error

      character(*), parameter :: trial = 'trial'
      character(kind=c_char), parameter :: block(4096) = ' '
      character(:), allocatable :: partial
      integer(c_int) :: code, ignored

      code = impactbeam_make_folder(trim(path)//c_null_char)
      if (code /= 0) then
         call fail(error, status_run_failed, "cannot make the folder '"//trim(path)//"': "//reason(code))
         return
      end if
      call impactbeam_remove_leftovers(trim(path)//c_null_char, partial_prefix(trial)//c_null_char)
      partial = trim(path)//'/'//partial_name(trial, posix_getpid())//c_null_char
      code = impactbeam_write_bytes(partial, block, size(block, kind=c_size_t))
      ignored = posix_unlink(partial)
      if (code /= 0) call fail(error, status_run_failed, "cannot write in the folder '"//trim(path)//"': "// &
         reason(code))
   end subroutine make_folder

   !> Write bytes to a file in a folder that is there. They go to a file of another name, which takes
   !> the place of the old one when it is complete: whatever fails, the old file stays as it was.
   subroutine replace_file(folder, name, bytes, error)
      character(*), intent(in) :: folder
      !> The file's name in it
      character(*), intent(in) :: name
      !> What the file is to hold
      character(kind=c_char), intent(in) :: bytes(:)
      !> Why it could not be written
      type(failure_t), allocatable, intent(out) :: error

      character(:), allocatable :: path, partial
      integer(c_int) :: code

      path = trim(folder)//'/'//trim(name)
      partial = trim(folder)//'/'//partial_name(name, posix_getpid())
      call impactbeam_remove_leftovers(trim(folder)//c_null_char, partial_prefix(name)//c_null_char)
      code = impactbeam_write_bytes(partial//c_null_char, bytes, size(bytes, kind=c_size_t))
      if (code == 0) code = impactbeam_rename(partial//c_null_char, path//c_null_char)
      if (code == 0) return
      call fail(error, status_run_failed, "cannot write '"//path//"': "//reason(code))
      ! Its own failure changes nothing: the next run removes what is left.
      code = posix_unlink(partial//c_null_char)
   end subroutine replace_file

   !> Give a file another name on the same disk, in place of the file that has it.
   subroutine move_file(from, to, error)
      character(*), intent(in) :: from
      character(*), intent(in) :: to
      !> Why it could not be moved
      type(failure_t), allocatable, intent(out) :: error

      integer(c_int) :: code

      code = impactbeam_rename(trim(from)//c_null_char, trim(to)//c_null_char)
      if (code /= 0) call fail(error, status_run_failed, "cannot write '"//trim(to)//"': "//reason(code))
   end subroutine move_file

   !> Make a folder that is not there, in one that is.
   subroutine make_new_folder(path, error)
      character(*), intent(in) :: path
      !> Why it could not be made
      type(failure_t), allocatable, intent(inout) :: error

      integer(c_int) :: code

      code = impactbeam_make_new_folder(trim(path)//c_null_char)
      if (code /= 0) call fail(error, status_run_failed, "cannot make the folder '"//trim(path)//"': "//reason(code))
   end subroutine make_new_folder

   !> Remove a folder if there is nothing in it.
   subroutine remove_empty_folder(path, is_gone)
      character(*), intent(in) :: path
      !> It was empty
      logical, intent(out) :: is_gone

      is_gone = impactbeam_remove_empty_folder(trim(path)//c_null_char) == 0
   end subroutine remove_empty_folder

   !> What has a name; a link is told as one, not followed.
   function kind_of(path) result(kind)
      character(*), intent(in) :: path
      integer :: kind

      kind = impactbeam_kind_of(trim(path)//c_null_char)
   end function kind_of

   !> What is in a folder; nothing where it cannot be read or is a link.
   subroutine folder_entries(path, entries)
      character(*), intent(in) :: path
      !> Their names, in no order
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

   !> Remove files of a folder that is no link; what is no file stays.
   subroutine remove_entries(path, entries)
      character(*), intent(in) :: path
      !> Names in it
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

   !> The bytes of a file that the program wrote; a link is not followed.
   subroutine load_file(path, bytes, error)
      character(*), intent(in) :: path
      !> What it holds
      character(kind=c_char), allocatable, intent(out) :: bytes(:)
      !> Why it could not be read
      type(failure_t), allocatable, intent(out) :: error

      character(:), allocatable :: problem

      call load_bytes(path, .false., huge(0), bytes, problem)
      if (allocated(problem)) call fail(error, status_run_failed, "cannot read '"//trim(path)//"': "//problem)
   end subroutine load_file

   !> The bytes of a regular file; nothing else is read, and nothing is waited for.
   subroutine load_bytes(path, follows_links, longest, bytes, problem)
      character(*), intent(in) :: path
      !> A link stands for the file that it leads to
      logical, intent(in) :: follows_links
      !> Most bytes that are read
      integer, intent(in) :: longest
      !> What the file holds
      character(kind=c_char), allocatable, intent(out) :: bytes(:)
      !> Why it could not be read; unallocated: it was
      character(:), allocatable, intent(out) :: problem

      integer(c_int) :: code, follows
      integer(c_size_t) :: count

      follows = merge(1_c_int, 0_c_int, follows_links)
      count = 0_c_size_t
      code = impactbeam_read_bytes(trim(path)//c_null_char, follows, count=count)
      if (code == 0 .and. count > int(longest, c_size_t)) then
         problem = 'it is too long: at most '//to_text(longest)//' bytes are read'
         count = 0_c_size_t
      end if
      allocate (bytes(count))
      if (code == 0 .and. count > 0_c_size_t) then
         code = impactbeam_read_bytes(trim(path)//c_null_char, follows, bytes, count)
      end if
      if (code /= 0) problem = reason(code)
   end subroutine load_bytes

   !> The name under which a process writes a file before it is complete: hidden, and no result by its ending.
   pure function partial_name(name, process) result(partial)
      !> The file's final name
      character(*), intent(in) :: name
      !> The number of the process
      integer, intent(in) :: process
      character(:), allocatable :: partial

      character(12) :: digits

      write (digits, '(i0)') process
      partial = partial_prefix(name)//trim(digits)
   end function partial_name

   !> The final name of a file from that of an incomplete form; any other name is its own.
   pure function final_name(name) result(final)
      character(*), intent(in) :: name
      character(:), allocatable :: final

      integer :: place

      final = name
      place = index(name, part_mark, back=.true.)
      if (index(name, '.') /= 1 .or. place <= 2) return
      if (verify(name(place + len(part_mark):), '0123456789') == 0) final = name(2:place - 1)
   end function final_name

   !> What the names of a file's incomplete forms begin with.
   pure function partial_prefix(name) result(prefix)
      !> The file's final name
      character(*), intent(in) :: name
      character(:), allocatable :: prefix

      prefix = '.'//trim(name)//part_mark
   end function partial_prefix

   !> Does somebody watch what is written there?
   function is_terminal(descriptor) result(answer)
      !> A file descriptor, such as `standard_error_descriptor`
      integer(c_int), intent(in) :: descriptor
      logical :: answer

      answer = posix_isatty(descriptor) == 1
   end function is_terminal

   !> The system's words for an error.
   function reason(code) result(words)
      integer(c_int), intent(in) :: code
      character(:), allocatable :: words

      integer, parameter :: longest = 200
      character(kind=c_char) :: text(longest)
      integer :: length

      call impactbeam_describe(code, text, int(longest, c_size_t))
      allocate (character(longest) :: words)
      do length = 1, longest
         if (text(length) == c_null_char) exit
         words(length:length) = text(length)
      end do
      words = words(:length - 1)
   end function reason

end module file_system
