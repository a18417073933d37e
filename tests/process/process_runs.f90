!> Starts of the real program for tests, by run_on.py beside this file, whose head tells how a test is added.
module process_runs
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: status_of, status_until, statuses, seconds_taken, said, said_errors, said_on_terminal
   public :: shell, prepare, write_text, text_of, is_there, input

contains

   !> Exit status of the program with some arguments; 124 when it did not end in time, 128 + n after signal n.
   function status_of(arguments, on, beside, program) result(status)
      !> Its arguments, as for a shell
      character(*), intent(in) :: arguments
      !> Options of run_on.py: terminal, streams, limits, disk, processes, signals
      character(*), intent(in), optional :: on
      !> Arguments of a second one, started at the same time
      character(*), intent(in), optional :: beside
      !> Environment variable that names the program; absent: IMPACTBEAM_PROGRAM
      character(*), intent(in), optional :: program
      integer :: status

      character(*), parameter :: pipes = 'run.requests run.answers'
      character(*), parameter :: ask = 'ask() { printf "%s\0" "$@" end > run.requests; read -r status < run.answers; '// &
         'return $status; }; ask'
      logical, save :: is_served = .false.
      character(:), allocatable :: command, variable

      variable = 'IMPACTBEAM_PROGRAM'
      if (present(program)) variable = program

      if (.not. is_served) then
         status = shell('rm -f '//pipes//' && mkfifo '//pipes//' && { $IMPACTBEAM_PYTHON "$IMPACTBEAM_RUN_ON" '// &
            '--serve $PPID < /dev/null > /dev/null 2>&1 & }')
         is_served = .true.
      end if
      ! paths may hold blanks
      command = ask
      if (present(on)) command = command//' '//on
      command = command//' -- "$'//variable//'" '//arguments
      if (present(beside)) command = command//' --and "$'//variable//'" '//beside
      status = shell(command)
   end function status_of

   !> The status of a start that something has to meet in time, such as a signal, or a second program: a start that ended
   !> sooner, with status 0, is made anew, after its results were removed, so that no machine is too fast.
   function status_until(arguments, results, on, beside) result(status)
      !> As for `status_of`
      character(*), intent(in) :: arguments
      !> The file that a whole run leaves
      character(*), intent(in) :: results
      character(*), intent(in), optional :: on, beside
      integer :: status

      integer, parameter :: most_starts = 30
      integer :: i

      do i = 1, most_starts
         status = status_of(arguments, on, beside)
         if (status /= 0) return
         status = shell('rm '//results)
      end do
      status = 0
   end function status_until

   !> Exit status of each program of the last start.
   function statuses() result(each)
      integer, allocatable :: each(:)

      real(wp), allocatable :: numbers(:)

      numbers = status_file()
      each = nint(numbers(:size(numbers) - 1))
   end function statuses

   !> How long the last start took.
   function seconds_taken() result(seconds)
      real(wp) :: seconds

      real(wp), allocatable :: numbers(:)

      numbers = status_file()
      seconds = numbers(size(numbers))
   end function seconds_taken

   !> A status for each program, then the seconds.
   function status_file() result(numbers)
      real(wp), allocatable :: numbers(:)

      real(wp) :: number
      integer :: unit, code

      allocate (numbers(0))
      open (newunit=unit, file='run.status', status='old', action='read')
      do
         read (unit, *, iostat=code) number
         if (code /= 0) exit
         numbers = [numbers, number]
      end do
      close (unit)
   end function status_file

   !> What the last start wrote on standard output, lines separated by blanks.
   function said() result(text)
      character(:), allocatable :: text

      text = text_of('run.out')
   end function said

   !> What it wrote on standard error.
   function said_errors() result(text)
      character(:), allocatable :: text

      text = text_of('run.errors')
   end function said_errors

   !> What appeared on its terminal.
   function said_on_terminal() result(text)
      character(:), allocatable :: text

      text = text_of('run.terminal')
   end function said_on_terminal

   !> Exit status of a command of the shell.
   function shell(command) result(status)
      character(*), intent(in) :: command
      integer :: status

      call execute_command_line(command, exitstat=status)
   end function shell

   !> No folder of that name, and beside it a scene, NAME.nml.
   subroutine prepare(name, text)
      character(*), intent(in) :: name
      character(*), intent(in) :: text

      integer :: ignored

      ignored = shell('rm -rf '//name)
      call write_text(name//'.nml', text)
   end subroutine prepare

   !> Write a small file.
   subroutine write_text(path, text)
      character(*), intent(in) :: path
      character(*), intent(in) :: text

      integer :: unit

      open (newunit=unit, file=path, status='replace', action='write')
      write (unit, '(a)') text
      close (unit)
   end subroutine write_text

   !> The whole of a file, lines separated by blanks; empty if it is not there.
   function text_of(path) result(text)
      character(*), intent(in) :: path
      character(:), allocatable :: text

      integer :: unit, code, length, i

      text = ''
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', action='read', iostat=code)
      if (code /= 0) return
      inquire (unit=unit, size=length)
      deallocate (text)
      allocate (character(length) :: text)
      if (length > 0) read (unit) text
      close (unit)
      do i = 1, length
         if (text(i:i) == new_line('a')) text(i:i) = ' '
      end do
   end function text_of

   !> Is there such a file, or a folder?
   function is_there(path) result(answer)
      character(*), intent(in) :: path
      logical :: answer

      inquire (file=path, exist=answer)
   end function is_there

   !> A scene of the project, as a word for the shell.
   function input(name) result(word)
      character(*), intent(in) :: name
      character(:), allocatable :: word

      word = '"$IMPACTBEAM_INPUTS"/'//name
   end function input

end module process_runs
