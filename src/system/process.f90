!> Standard streams, signals, stack and exit of this process, and the memory that it can still allocate
!> (machine_memory_posix.c).
module process
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_ptr, c_size_t, c_double
   use failures, only: fail, failure_t, status_run_failed
   use file_system, only: reason
   use kinds, only: wp
   use number_text, only: to_text
   implicit none (type, external)
   private
   public :: prepare_process, run_on_default_stack, open_text, text_of, print_text, end_process, free_memory, &
      free_addresses, in_bytes

   interface
      !> Free memory and swap of this process within the limits of its control groups, in bytes; infinite: unknown.
      function free_memory() bind(c, name='impactbeam_free_memory') result(bytes)
         import :: c_double
         implicit none (type, external)
         real(c_double) :: bytes
      end function free_memory

      !> Free address space if it is limited (ulimit -v), in bytes; infinite: unlimited.
      function free_addresses() bind(c, name='impactbeam_free_addresses') result(bytes)
         import :: c_double
         implicit none (type, external)
         real(c_double) :: bytes
      end function free_addresses
   end interface

   !> File descriptor of standard output.
   integer(c_int), parameter :: standard_output_descriptor = 1_c_int

   abstract interface
      !> The work of a thread.
      function work_interface(data) bind(c) result(nothing)
         import :: c_ptr
         implicit none (type, external)
         type(c_ptr), value :: data
         type(c_ptr) :: nothing
      end function work_interface

      !> A part of the preparation of this process.
      subroutine preparation_t() bind(c)
         implicit none (type, external)
      end subroutine preparation_t
   end interface

   ! procedures that are documented in process_posix.c
   procedure(preparation_t), bind(c) :: impactbeam_reserve_streams, impactbeam_catch_signals, impactbeam_retain_memory

   interface
      ! The following procedures are documented in process_posix.c, too.
      !> Call `work` on a stack of at least the default size.
      subroutine run_on_default_stack(work, data) bind(c, name='impactbeam_work_on_usual_stack')
         import :: c_ptr, work_interface
         implicit none (type, external)
         procedure(work_interface) :: work
         !> Argument of `work`
         type(c_ptr), value :: data
      end subroutine run_on_default_stack

      !> Exit with a status and without a message, which `stop` does not do with every compiler. Only main programs may
      !> call this.
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

   !> Prepare streams, signals and memory. This is the first call of a program.
   subroutine prepare_process()
      call impactbeam_reserve_streams()
      call impactbeam_catch_signals()
      call impactbeam_retain_memory()
   end subroutine prepare_process

   !> Open a unit for a text that `text_of` reads back.
   subroutine open_text(unit, error)
      integer, intent(out) :: unit
      !> Set if no temporary file can be opened
      type(failure_t), allocatable, intent(inout) :: error

      integer :: status

      open (newunit=unit, status='scratch', access='stream', form='formatted', action='readwrite', iostat=status)
      if (status /= 0) call fail(error, status_run_failed, &
         'cannot open a temporary file for a table; TMPDIR names its folder')
   end subroutine open_text

   !> Read back the text that was written to a unit, and close the unit.
   subroutine text_of(unit, text, error)
      integer, intent(in) :: unit
      character(:), allocatable, intent(out) :: text
      !> Set if the temporary file is incomplete
      type(failure_t), allocatable, intent(inout) :: error

      character(256) :: buffer
      ! next position in the unit
      integer :: position
      ! size of the file of the unit in bytes
      integer :: stored
      integer :: length, status

      flush (unit)
      ! libgfortran does not report a write that failed
      inquire (unit=unit, pos=position, size=stored)
      if (stored < position - 1) call fail(error, status_run_failed, &
         'cannot write a temporary file; TMPDIR names its folder')
      rewind (unit)
      text = ''
      do
         read (unit, '(a)', advance='no', size=length, iostat=status) buffer
         if (is_iostat_end(status)) exit
         text = text//buffer(:length)
         if (is_iostat_eor(status)) then
            text = text//new_line('a')
         else if (status /= 0) then
            exit
         end if
      end do
      close (unit)
   end subroutine text_of

   !> Print a text to standard output without Fortran units, because they do not report a write that failed.
   subroutine print_text(text, error)
      !> The text, lines ended by new_line('a')
      character(*), intent(in) :: text
      !> Reason why the text could not be written
      type(failure_t), allocatable, intent(inout) :: error

      integer(c_int) :: code

      code = impactbeam_write_all(standard_output_descriptor, text, len(text, kind=c_size_t))
      if (code /= 0) call fail(error, status_run_failed, 'cannot write to standard output: '//reason(code))
   end subroutine print_text

   !> A number of bytes in words, such as '12.3 GB'.
   pure function in_bytes(bytes) result(words)
      real(wp), intent(in) :: bytes
      character(:), allocatable :: words

      real(wp), parameter :: megabyte = 1.0e6_wp, gigabyte = 1.0e9_wp, max_gigabytes = 1.0e9_wp
      character(16) :: digits

      if (bytes < gigabyte) then
         words = to_text(nint(bytes/megabyte))//' MB'
      else if (bytes < 100.0_wp*gigabyte) then
         write (digits, '(f0.1)') bytes/gigabyte
         words = trim(digits)//' GB'
      else
         words = to_text(nint(min(bytes/gigabyte, max_gigabytes)))//' GB'
      end if
   end function in_bytes

end module process
