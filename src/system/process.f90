!> This process as the system sees it: its streams and its signals.
module process
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_ptr, c_size_t
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: reason
   implicit none (type, external)
   private
   public :: prepare_process, work_on_usual_stack, open_text, text_of, print_text, end_process

   integer(c_int), parameter :: standard_output_descriptor = 1_c_int

   abstract interface
      !> A thread's work.
      function work_interface(data) bind(c) result(nothing)
         import :: c_ptr
         implicit none (type, external)
         type(c_ptr), value :: data
         type(c_ptr) :: nothing
      end function work_interface
   end interface

   interface
      ! These are explained in process_posix.c.
      subroutine impactbeam_hold_streams() bind(c)
         implicit none (type, external)
      end subroutine impactbeam_hold_streams

      subroutine impactbeam_take_signals() bind(c)
         implicit none (type, external)
      end subroutine impactbeam_take_signals

      subroutine impactbeam_keep_memory() bind(c)
         implicit none (type, external)
      end subroutine impactbeam_keep_memory

      !> Do some work where there is a stack of the usual size.
      subroutine work_on_usual_stack(work, data) bind(c, name='impactbeam_work_on_usual_stack')
         import :: c_ptr, work_interface
         implicit none (type, external)
         procedure(work_interface) :: work
         !> What the work is given
         type(c_ptr), value :: data
      end subroutine work_on_usual_stack

      !> End with a status, in silence, as `stop` cannot everywhere: for main programs alone.
      subroutine end_process(status) bind(c, name='exit')
         import :: c_int
         implicit none (type, external)
         integer(c_int), value :: status
      end subroutine end_process

      function impactbeam_write_all(descriptor, bytes, count) bind(c) result(code)
         import :: c_char, c_int, c_size_t
         implicit none (type, external)
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: count
         integer(c_int) :: code
      end function impactbeam_write_all
   end interface

contains

   !> To be called first.
   subroutine prepare_process()
      call impactbeam_hold_streams()
      call impactbeam_take_signals()
      call impactbeam_keep_memory()
   end subroutine prepare_process

   !> Open a unit for a text that is to be read back.
   subroutine open_text(unit, error)
      integer, intent(out) :: unit
      !> Set when there is no room for temporary files
      type(failure_t), allocatable, intent(inout) :: error

      integer :: status

      open (newunit=unit, status='scratch', access='stream', form='formatted', action='readwrite', iostat=status)
      if (status /= 0) call fail(error, status_run_failed, &
         'cannot open a temporary file for a table; TMPDIR names its folder')
   end subroutine open_text

   !> What was written to the unit, which is closed.
   subroutine text_of(unit, text, error)
      integer, intent(in) :: unit
      character(:), allocatable, intent(out) :: text
      !> Set when the temporary file does not hold all of it
      type(failure_t), allocatable, intent(inout) :: error

      character(256) :: piece
      integer :: place, held, length, status

      flush (unit)
      ! libgfortran does not tell a write that failed
      inquire (unit=unit, pos=place, size=held)
      if (held < place - 1) call fail(error, status_run_failed, &
         'cannot write a temporary file; TMPDIR names its folder')
      rewind (unit)
      text = ''
      do
         read (unit, '(a)', advance='no', size=length, iostat=status) piece
         if (is_iostat_end(status)) exit
         text = text//piece(:length)
         if (is_iostat_eor(status)) then
            text = text//new_line('a')
         else if (status /= 0) then
            exit
         end if
      end do
      close (unit)
   end subroutine text_of

   !> Print a text to standard output. Fortran's own units do not tell a write that failed.
   subroutine print_text(text, error)
      !> The text; its lines end with new_line('a')
      character(*), intent(in) :: text
      !> Why it could not be written
      type(failure_t), allocatable, intent(inout) :: error

      integer(c_int) :: code

      code = impactbeam_write_all(standard_output_descriptor, text, len(text, kind=c_size_t))
      if (code /= 0) call fail(error, status_run_failed, 'cannot write to standard output: '//reason(code))
   end subroutine print_text

end module process
