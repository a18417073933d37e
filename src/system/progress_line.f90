!> A progress line of a long run on the terminal: label, seconds, and completed fraction.
module progress_line
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char, c_ptr
   use file_system, only: is_terminal, standard_error_descriptor
   use run_progress, only: progress_address
   implicit none (type, external)
   private
   public :: start_progress, stop_progress, terminal_width

   !> Milliseconds after which a run counts as long.
   integer(c_int), parameter :: long_run = 2000_c_int

   interface
      ! The following procedures are documented in progress_line_posix.c; `fraction` is the address of the completed
      ! fraction of the run.
      subroutine impactbeam_start_progress(label, descriptor, delay, fraction) bind(c)
         import :: c_char, c_int, c_ptr
         implicit none (type, external)
         character(kind=c_char), intent(in) :: label(*)
         integer(c_int), value :: descriptor
         integer(c_int), value :: delay
         type(c_ptr), value :: fraction
      end subroutine impactbeam_start_progress

      !> Stop the progress line and erase it.
      subroutine stop_progress() bind(c, name='impactbeam_stop_progress')
         implicit none (type, external)
      end subroutine stop_progress

      !> Number of columns of a terminal; 80 if unknown.
      function terminal_width(descriptor) bind(c, name='impactbeam_terminal_width') result(columns)
         import :: c_int
         implicit none (type, external)
         integer(c_int), value :: descriptor
         integer(c_int) :: columns
      end function terminal_width
   end interface

contains

   !> Start the progress line. The line appears when the run has taken long, on standard error if that is a terminal.
   subroutine start_progress(label, descriptor, delay)
      !> Label of the run
      character(*), intent(in) :: label
      !> File descriptor to which the line is always written; absent: standard error, if it is a terminal
      integer(c_int), intent(in), optional :: descriptor
      !> Milliseconds before the first line; absent: 2000
      integer(c_int), intent(in), optional :: delay

      ! milliseconds before the first line
      integer(c_int) :: first

      first = long_run
      if (present(delay)) first = delay
      if (present(descriptor)) then
         call impactbeam_start_progress(trim(label)//c_null_char, descriptor, first, progress_address())
      else if (is_terminal(standard_error_descriptor)) then
         call impactbeam_start_progress(trim(label)//c_null_char, standard_error_descriptor, first, progress_address())
      end if
   end subroutine start_progress

end module progress_line
