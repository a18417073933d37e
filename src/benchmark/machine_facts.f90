!> Conditions on which a timing depends besides the program (processor, compiler, build), and the memory of the process.
!> Processor and memory are read from /proc if the system has it.
module machine_facts
   use, intrinsic :: iso_fortran_env, only: compiler_options
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: processor_name, options_of_compiler, kind_of_build, peak_memory, reset_peak_memory

   !> Maximum length of a line of the files in /proc.
   integer, parameter :: line_length = 256

   interface
      !> Return freed memory to the system if the C library can do so.
      subroutine return_free_memory() bind(c, name='impactbeam_return_free_memory')
         implicit none (type, external)
      end subroutine return_free_memory
   end interface

contains

   !> Name of the processor; empty if it is not known.
   function processor_name() result(name)
      character(:), allocatable :: name

      name = value_in('/proc/cpuinfo', 'model name')
   end function processor_name

   !> Options of the compiler, without those that contain folders.
   function options_of_compiler() result(options)
      character(:), allocatable :: options

      character(:), allocatable :: all_options, word
      integer :: position, next
      ! whether the next word is the argument of an option that is left out
      logical :: skips_word

      all_options = compiler_options()//' '
      options = ''
      position = 1
      skips_word = .false.
      do while (position <= len(all_options))
         next = position + index(all_options(position:), ' ') - 1
         word = all_options(position:next - 1)
         position = next + 1
         if (skips_word .or. len(word) == 0) then
            skips_word = .false.
            cycle
         end if
         skips_word = word == '-I' .or. word == '-J' .or. word == '-o'
         if (skips_word .or. scan(word, '/') > 0) cycle
         if (len(options) > 0) options = options//' '
         options = options//word
      end do
   end function options_of_compiler

   !> Kind of the build ('release' or 'debug', and 'with checks'), from the options of the compiler.
   function kind_of_build() result(kind)
      character(:), allocatable :: kind

      kind = 'debug'
      if (index(compiler_options(), '-O3') > 0) kind = 'release'
      if (index(compiler_options(), '-fcheck') > 0) kind = kind//' with checks'
   end function kind_of_build

   !> Maximum memory of the process since the last call of `reset_peak_memory`, in bytes; 0 if it is not known.
   real(wp) function peak_memory() result(bytes)

      character(:), allocatable :: value
      integer :: status, kilobytes

      bytes = 0.0_wp
      ! the peak of the resident memory, in kilobytes
      value = value_in('/proc/self/status', 'VmHWM')
      if (len(value) == 0) return
      read (value, *, iostat=status) kilobytes
      if (status == 0) bytes = 1024.0_wp*real(kilobytes, wp)
   end function peak_memory

   !> Return freed memory to the system and restart the measurement of peak memory. If the system does not permit the
   !> restart, later peaks are those of the whole process.
   subroutine reset_peak_memory()
      integer :: unit, status

      call return_free_memory()
      open (newunit=unit, file='/proc/self/clear_refs', status='old', action='write', iostat=status)
      if (status /= 0) return
      ! by writing 5, Linux resets VmHWM
      write (unit, '(a)', iostat=status) '5'
      close (unit, iostat=status)
   end subroutine reset_peak_memory

   !> Text after the colon in the first line of a file that starts with a name; empty if there is no such line.
   function value_in(file, name) result(value)
      character(*), intent(in) :: file
      character(*), intent(in) :: name
      character(:), allocatable :: value

      character(line_length) :: line
      integer :: i, unit, status

      value = ''
      open (newunit=unit, file=file, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, name) /= 1) cycle
         line = line(index(line, ':') + 1:)
         do i = 1, len(line)
            if (line(i:i) == achar(9)) line(i:i) = ' '
         end do
         value = trim(adjustl(line))
         exit
      end do
      close (unit, iostat=status)
   end function value_in

end module machine_facts
