!> What the user typed after the program's name.
module command_line
   use failures, only: fail, failure_t, status_bad_input
   use program_identity, only: program_name
   use scene_templates, only: template_kinds
   use table_texts, only: table_formats
   implicit none (type, external)
   private
   public :: command_line_t, get_arguments, parse_arguments, argument_t, usage

   !> Options with a value, which follows or stands behind =
   character(*), parameter :: with_value(*) = [character(9) :: '--threads', '--out', '--new', '--format']

   !> One word of the command line.
   type :: argument_t
      character(:), allocatable :: text
   end type argument_t

   type :: command_line_t
      !> Scene files in the order given
      type(argument_t), allocatable :: scenes(:)
      !> Folder of the results
      character(:), allocatable :: folder
      !> Stop after checking the scenes
      logical :: check_only = .false.
      !> Estimate what the mesh does
      logical :: estimate = .false.
      !> Nothing on standard output but errors on standard error
      logical :: quiet = .false.
      !> Threads of a sweep; 0: as many as there are cores
      integer :: threads = 0
      !> Print the version, or the help, and nothing else
      logical :: wants_version = .false.
      logical :: wants_help = .false.
      !> Print the names that a scene can hold: of this group, empty: of all, unallocated: none; in Markdown
      character(:), allocatable :: names
      logical :: wants_markdown = .false.
      !> Tables for other programs: one of `table_formats`; unallocated: none
      character(:), allocatable :: format
      !> Print a scene of this kind to begin from
      character(:), allocatable :: template
   end type command_line_t

contains

   !> The words of the command line.
   subroutine get_arguments(arguments)
      !> Without the program's name
      type(argument_t), allocatable, intent(out) :: arguments(:)

      integer :: i, length

      allocate (arguments(command_argument_count()))
      do i = 1, size(arguments)
         call get_command_argument(i, length=length)
         allocate (character(length) :: arguments(i)%text)
         if (length > 0) call get_command_argument(i, arguments(i)%text)
      end do
   end subroutine get_arguments

   !> Understand the words.
   pure subroutine parse_arguments(arguments, command, error)
      !> The words
      type(argument_t), intent(in) :: arguments(:)
      !> What they mean
      type(command_line_t), intent(out) :: command
      !> Set when they mean nothing
      type(failure_t), allocatable, intent(out) :: error

      !> Options with a value so far, each between blanks
      character(:), allocatable :: options
      !> The option that prints and runs nothing to which each word belongs
      character(7) :: owner(size(arguments))
      logical :: is_scene(size(arguments)), only_files
      integer :: first, i

      command%folder = 'results'
      options = ' '
      owner = ''
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
               owner(i) = '--names'
            else if (word == '--names' .or. index(word, '--names=') == 1) then
               call take_group(arguments, i, command, error)
               owner(first:i) = '--names'
            else if (word == '--help' .or. word == '-h') then
               command%wants_help = .true.
            else if (any(with_value == word(:scan(word//'=', '=') - 1))) then
               call take_value(arguments, i, options, command, error)
               if (allocated(error)) return
               if (index(word, '--new') == 1) owner(first:i) = '--new'
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
      end if
      allocate (command%scenes(count(is_scene)))
      command%scenes(:) = pack(arguments, is_scene)
      if (command%wants_help .or. command%wants_version) return
      if (command%wants_markdown .and. .not. allocated(command%names)) then
         call fail(error, status_bad_input, '--markdown goes with --names')
      else if (allocated(command%names) .or. allocated(command%template)) then
         call refuse_company(arguments, owner, command, error)
      else if (size(command%scenes) == 0) then
         call fail(error, status_bad_input, 'no scene file given; --help tells how to use it')
      end if
   end subroutine parse_arguments

   !> An option that prints a list or a scene runs nothing: words that it would ignore are refused.
   pure subroutine refuse_company(arguments, owner, command, error)
      !> The words
      type(argument_t), intent(in) :: arguments(:)
      !> The option to which each belongs
      character(*), intent(in) :: owner(:)
      !> What they mean
      type(command_line_t), intent(in) :: command
      !> Set when there are other words
      type(failure_t), allocatable, intent(inout) :: error

      character(7) :: option
      integer :: i

      option = merge('--new  ', '--names', allocated(command%template))
      do i = 1, size(arguments)
         if (owner(i) /= option) call fail(error, status_bad_input, trim(option)//" prints and runs nothing: '" &
            //arguments(i)%text//"' has no place beside it")
      end do
   end subroutine refuse_company

   !> '--names', '--names GROUP' or '--names=GROUP'.
   pure subroutine take_group(arguments, i, command, error)
      !> The words, and the place of the option, then of the group
      type(argument_t), intent(in) :: arguments(:)
      integer, intent(inout) :: i
      type(command_line_t), intent(inout) :: command
      !> Set when the option was given before
      type(failure_t), allocatable, intent(inout) :: error

      if (allocated(command%names)) call fail(error, status_bad_input, '--names is given twice')
      command%names = arguments(i)%text(len('--names=') + 1:)
      if (arguments(i)%text /= '--names' .or. i == size(arguments)) return
      if (arguments(i + 1)%text == '' .or. index(arguments(i + 1)%text, '-') == 1) return
      i = i + 1
      command%names = arguments(i)%text
   end subroutine take_group

   !> An option with its value, as '--out DIR' or '--out=DIR'.
   pure subroutine take_value(arguments, i, options, command, error)
      !> The words, and the place of the option, then of its value
      type(argument_t), intent(in) :: arguments(:)
      integer, intent(inout) :: i
      !> Those given before, each between blanks; then this one too
      character(:), allocatable, intent(inout) :: options
      type(command_line_t), intent(inout) :: command
      !> Set when the value is missing or wrong, or the option was given before
      type(failure_t), allocatable, intent(inout) :: error

      character(:), allocatable :: option, value, word
      integer :: cut

      word = arguments(i)%text
      cut = index(word, '=')
      if (cut > 0) then
         option = word(:cut - 1)
         value = word(cut + 1:)
      else
         option = word
         i = i + 1
         if (i > size(arguments)) then
            call fail(error, status_bad_input, option//' needs '//words_after(option)//' after it')
            return
         end if
         value = arguments(i)%text
      end if
      if (index(options, ' '//option//' ') > 0) call fail(error, status_bad_input, option//' is given twice')
      options = options//option//' '
      select case (option)
      case ('--threads')
         call read_threads(value, command%threads, error)
      case ('--out')
         command%folder = value
      case ('--format')
         command%format = value
         if (all(table_formats /= value)) call fail(error, status_bad_input, &
            option//' '//value//': must be '//words_after(option))
      case ('--new')
         command%template = value
         if (all(template_kinds /= value)) call fail(error, status_bad_input, &
            option//' '//value//': must be '//words_after(option))
      end select
   end subroutine take_value

   !> A number of threads.
   pure subroutine read_threads(word, threads, error)
      !> What the user wrote
      character(*), intent(in) :: word
      !> The number
      integer, intent(inout) :: threads
      !> Set when it is none
      type(failure_t), allocatable, intent(inout) :: error

      integer, parameter :: most_threads = 4096, most_digits = 4
      integer :: number

      number = 0
      if (len(word) >= 1 .and. len(word) <= most_digits .and. verify(word, '0123456789') == 0) then
         read (word, '(i4)') number
      end if
      if (number < 1 .or. number > most_threads) then
         call fail(error, status_bad_input, '--threads '//word//': must be a whole number from 1 to 4096')
      else
         threads = number
      end if
   end subroutine read_threads

   !> What may stand after an option.
   pure function words_after(option) result(words)
      !> One of `with_value`
      character(*), intent(in) :: option
      character(:), allocatable :: words

      integer :: i

      select case (option)
      case ('--threads')
         words = 'a number'
      case ('--out')
         words = 'the name of a folder'
      case ('--format')
         words = trim(table_formats(1))//' or '//trim(table_formats(2))
      case default
         words = 'one of '//trim(template_kinds(1))
         do i = 2, size(template_kinds)
            words = words//', '//trim(template_kinds(i))
         end do
      end select
   end function words_after

   !> The help text, lines separated by new_line('a').
   pure function usage(name, purpose, example) result(text)
      !> The program's name, and what it does
      character(*), intent(in) :: name
      character(*), intent(in) :: purpose
      !> What to type first, lines ended by new_line('a')
      character(*), intent(in), optional :: example
      character(:), allocatable :: text

      character, parameter :: next = new_line('a')
      character(:), allocatable :: format_line

      format_line = ''
      if (name == program_name) format_line = &
         '  --format F  also measures, sweep, frequencies as csv or json, beside that file'//next
      text = 'usage: '//name//' SCENE.nml... [options]'//next//next// &
         purpose//next// &
         'Each scene is a Fortran namelist file, and leaves DIR/<name>.h5 and a table.'//next// &
         next// &
         '  --out DIR   folder of the results (default: results)'//next// &
         '  --check     read and check the scenes and the memory they need, no more'//next// &
         '  --estimate  estimate the error of the mesh, as &mesh estimate = .true. does'//next// &
         format_line// &
         '  --threads N threads of a sweep (default: one a core; at most four)'//next// &
         '  --quiet     no tables'//next// &
         '  --new KIND  print a scene to begin from: beam, relay, tube or reed'//next// &
         '  --names [G] print every name of a scene, or of its group G: what it may be,'//next// &
         '              its default, what it means; with --markdown for pages'//next// &
         '  --version   print the version'//next// &
         '  --help      print this'//next// &
         next
      if (present(example)) text = text//'To begin:'//next//next//example//next
      text = text//'Exit status: 0 done, 1 a run failed, 2 bad usage or input.'//next
   end function usage

end module command_line
