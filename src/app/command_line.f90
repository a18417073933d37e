!> The arguments of the command line.
module command_line
   use failures, only: fail, failure_t, status_bad_input
   use printable_text, only: joined
   use program_identity, only: program_name
   use scene_templates, only: template_kinds
   use table_texts, only: table_formats
   implicit none (type, external)
   private
   public :: command_line_t, get_arguments, parse_arguments, argument_t, usage

   !> Options with a value, which is the next argument or follows the sign =.
   character(*), parameter :: valued_options(*) = [character(9) :: '--threads', '--out', '--new', '--format']

   !> One argument of the command line.
   type :: argument_t
      character(:), allocatable :: text
   end type argument_t

   !> The requests of the command line.
   type :: command_line_t
      !> Scene files in the order given
      type(argument_t), allocatable :: scenes(:)
      !> Folder of the results
      character(:), allocatable :: folder
      !> Whether to stop after checking the scenes
      logical :: check_only = .false.
      !> Whether to estimate the discretisation error of the mesh
      logical :: estimate = .false.
      !> Whether to print nothing except errors, on standard error
      logical :: quiet = .false.
      !> Number of threads of a sweep; 0: as many as there are cores
      integer :: threads = 0
      !> Whether to print only the version
      logical :: wants_version = .false.
      !> Whether to print only the help
      logical :: wants_help = .false.
      !> Group whose names are printed; empty: all groups; unallocated: none
      character(:), allocatable :: names
      !> Whether to print the names as a table in Markdown
      logical :: wants_markdown = .false.
      !> Format of tables for other programs, one of `table_formats`; unallocated: no tables
      character(:), allocatable :: format
      !> Kind of the template scene that is printed; unallocated: none
      character(:), allocatable :: template
   end type command_line_t

contains

   !> Get the arguments of the command line.
   subroutine get_arguments(arguments)
      !> Arguments without the name of the program
      type(argument_t), allocatable, intent(out) :: arguments(:)

      integer :: i, length

      allocate (arguments(command_argument_count()))
      do i = 1, size(arguments)
         call get_command_argument(i, length=length)
         allocate (character(length) :: arguments(i)%text)
         if (length > 0) call get_command_argument(i, arguments(i)%text)
      end do
   end subroutine get_arguments

   !> Interpret the arguments.
   pure subroutine parse_arguments(arguments, command, error)
      type(argument_t), intent(in) :: arguments(:)
      !> Meaning of the arguments
      type(command_line_t), intent(out) :: command
      !> Set if the arguments are invalid
      type(failure_t), allocatable, intent(out) :: error

      ! options with a value that have been read, each between blanks
      character(:), allocatable :: options
      ! '--names' or '--new' for each argument that belongs to this option, which only prints; else empty
      character(7) :: option_of(size(arguments))
      logical :: is_scene(size(arguments))
      ! whether '--' has been read, after which every argument is a scene file
      logical :: only_files
      ! index of an option
      integer :: first
      ! index of the value of this option, if it has one
      integer :: i

      command%folder = 'results'
      options = ' '
      option_of = ''
      is_scene = .false.
      only_files = .false.
      i = 0
      do while (i < size(arguments))
         i = i + 1
         first = i
         associate (word => arguments(i)%text)
            if (only_files .or. index(word, '-') /= 1 .or. len(word) == 1) then
               is_scene(i) = .true.
            else if (word == '--') then
               only_files = .true.
            else if (word == '--check') then
               command%check_only = .true.
            else if (word == '--estimate') then
               command%estimate = .true.
            else if (word == '--quiet') then
               command%quiet = .true.
            else if (word == '--version') then
               command%wants_version = .true.
            else if (word == '--markdown') then
               command%wants_markdown = .true.
               option_of(i) = '--names'
            else if (word == '--names' .or. index(word, '--names=') == 1) then
               call read_group(arguments, i, command, error)
               option_of(first:i) = '--names'
            else if (word == '--help' .or. word == '-h') then
               command%wants_help = .true.
            else if (any(valued_options == word(:scan(word//'=', '=') - 1))) then
               call read_value(arguments, i, options, command, error)
               if (allocated(error)) return
               if (index(word, '--new') == 1) option_of(first:i) = '--new'
            else
               call fail(error, status_bad_input, 'unknown option '//word//': allowed are --out DIR, --check, &
               &--estimate, --format csv or json, --threads N, --quiet, --new KIND, --names, --markdown, --version, &
               &--help')
               return
            end if
         end associate
      end do
      if (len(command%folder) == 0) then
         call fail(error, status_bad_input, '--out needs the name of a folder, got an empty one')
         return
      else if (len_trim(command%folder) < len(command%folder)) then
         call fail(error, status_bad_input, "--out: the name of a folder must not end in a blank, got '"// &
            command%folder//"'")
         return
      end if
      allocate (command%scenes(count(is_scene)))
      command%scenes(:) = pack(arguments, is_scene)
      if (command%wants_help .or. command%wants_version) return
      if (command%wants_markdown .and. .not. allocated(command%names)) then
         call fail(error, status_bad_input, '--markdown goes with --names')
      else if (allocated(command%names) .or. allocated(command%template)) then
         call refuse_other_arguments(arguments, option_of, command, error)
      else if (size(command%scenes) == 0) then
         call fail(error, status_bad_input, 'no scene file given; --help shows how to use it')
      end if
   end subroutine parse_arguments

   !> Refuse further arguments beside an option that only prints a list or a scene, because they would be ignored.
   pure subroutine refuse_other_arguments(arguments, option_of, command, error)
      type(argument_t), intent(in) :: arguments(:)
      !> '--names' or '--new' for each argument that belongs to this option, else empty
      character(*), intent(in) :: option_of(:)
      !> Meaning of the arguments
      type(command_line_t), intent(in) :: command
      !> Set if there are other arguments
      type(failure_t), allocatable, intent(inout) :: error

      character(7) :: option
      integer :: i

      option = merge('--new  ', '--names', allocated(command%template))
      i = findloc(option_of /= option, .true., dim=1)
      if (i > 0) call fail(error, status_bad_input, trim(option)//" prints and runs nothing: '" &
         //arguments(i)%text//"' has no place beside it")
   end subroutine refuse_other_arguments

   !> Read the option '--names', '--names GROUP' or '--names=GROUP'.
   pure subroutine read_group(arguments, i, command, error)
      type(argument_t), intent(in) :: arguments(:)
      !> Index of the option on entry, of the last argument that was read on return
      integer, intent(inout) :: i
      type(command_line_t), intent(inout) :: command
      !> Set if the option was given before
      type(failure_t), allocatable, intent(inout) :: error

      if (allocated(command%names)) call fail(error, status_bad_input, '--names is given twice')
      command%names = arguments(i)%text(len('--names=') + 1:)
      if (arguments(i)%text /= '--names' .or. i == size(arguments)) return
      if (arguments(i + 1)%text == '' .or. index(arguments(i + 1)%text, '-') == 1) return
      i = i + 1
      command%names = arguments(i)%text
   end subroutine read_group

   !> Read an option with its value, such as '--out DIR' or '--out=DIR'.
   pure subroutine read_value(arguments, i, options, command, error)
      type(argument_t), intent(in) :: arguments(:)
      !> Index of the option on entry, of its value on return
      integer, intent(inout) :: i
      !> Options that were read before, each between blanks; this option is appended
      character(:), allocatable, intent(inout) :: options
      type(command_line_t), intent(inout) :: command
      !> Set if the value is missing or invalid, or the option was given before
      type(failure_t), allocatable, intent(inout) :: error

      ! maximum number of threads, and of its digits
      integer, parameter :: max_threads = 4096, max_digits = 4
      character(:), allocatable :: option, value, word
      integer :: equals_sign, number

      word = arguments(i)%text
      equals_sign = index(word, '=')
      if (equals_sign > 0) then
         option = word(:equals_sign - 1)
         value = word(equals_sign + 1:)
      else
         option = word
         i = i + 1
         if (i > size(arguments)) then
            call fail(error, status_bad_input, option//' needs '//description_of_values(option)//' after it')
            return
         end if
         value = arguments(i)%text
      end if
      if (index(options, ' '//option//' ') > 0) call fail(error, status_bad_input, option//' is given twice')
      options = options//option//' '
      select case (option)
      case ('--threads')
         number = 0
         if (len(value) >= 1 .and. len(value) <= max_digits .and. verify(value, '0123456789') == 0) then
            read (value, '(i4)') number
         end if
         if (number < 1 .or. number > max_threads) then
            call fail(error, status_bad_input, '--threads '//value//': must be a whole number from 1 to 4096')
         else
            command%threads = number
         end if
      case ('--out')
         command%folder = value
      case ('--format')
         command%format = value
         if (all(table_formats /= value)) call fail(error, status_bad_input, &
            option//' '//value//': must be '//description_of_values(option))
      case ('--new')
         command%template = value
         if (all(template_kinds /= value)) call fail(error, status_bad_input, &
            option//' '//value//': must be '//description_of_values(option))
      end select
   end subroutine read_value

   !> Description of the values that an option may have.
   pure function description_of_values(option) result(words)
      !> One of `valued_options`
      character(*), intent(in) :: option
      character(:), allocatable :: words

      select case (option)
      case ('--threads')
         words = 'a number'
      case ('--out')
         words = 'the name of a folder'
      case ('--format')
         words = trim(table_formats(1))//' or '//trim(table_formats(2))
      case default
         words = 'one of '//joined(template_kinds, ', ')
      end select
   end function description_of_values

   !> The help text, lines separated by new_line('a').
   pure function usage(name, purpose, example) result(text)
      !> Name of the program
      character(*), intent(in) :: name
      !> Purpose of the program
      character(*), intent(in) :: purpose
      !> Example of a first use, lines ended by new_line('a')
      character(*), intent(in), optional :: example
      character(:), allocatable :: text

      character, parameter :: line_end = new_line('a')
      ! options that the other programs do not have
      character(:), allocatable :: own_options

      own_options = ''
      if (name == program_name) own_options = &
         '  --estimate  estimate the error of the mesh, as &mesh estimate = .true. does'//line_end// &
         '  --format F  write measures, sweep and frequencies as csv or json, too'//line_end// &
         '  --threads N threads of a sweep (default: one per core, at most four)'//line_end
      text = 'usage: '//name//' SCENE.nml... [options]'//line_end//line_end// &
         purpose//line_end// &
         'Each scene, a Fortran namelist file, gives DIR/<name>.h5 and a table.'//line_end// &
         line_end// &
         '  --out DIR   folder of the results (default: results)'//line_end// &
         '  --check     read and check the scenes and the memory they need; run nothing'//line_end// &
         own_options// &
         '  --quiet     no tables'//line_end// &
         '  --new KIND  print a scene to begin from: beam, relay, tube or reed'//line_end// &
         '  --names [G] print every name of a scene, or of its group G, with the allowed'//line_end// &
         '              values, default and meaning; --markdown: as a table for pages;'//line_end// &
         '              of --names measures every result of a run that has one number'//line_end// &
         '  --version   print the version'//line_end// &
         '  --help      print this'//line_end// &
         line_end
      if (present(example)) text = text//'To begin:'//line_end//line_end//example//line_end
      text = text//'Exit status: 0 done, 1 a run failed, 2 the command or a scene is wrong.'//line_end
   end function usage

end module command_line
