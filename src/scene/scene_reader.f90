!> Reads a scene file: its values are checked and made dimensionless. The module also makes messages about a scene that
!> was read, and changes its parameters in sweeps and &cases.
module scene_reader
   use failures, only: fail, failure_t, status_bad_input
   use file_system, only: load_text
   use kinds, only: wp
   use name_table, only: table_t
   use namelist_text, only: namelist_t, parse_namelist
   use number_text, only: to_text
   use program_identity, only: program_any
   use run_settings, only: end_of_run, stop_settings_t
   use scene_beam, only: min_tip_ratio
   use scene_groups, only: copy_changes_to_scene, list_group, list_scene
   use scene_input, only: scene_input_t
   use scene_reference, only: make_echo
   use scene_resolve, only: resolve_scene, resolve_units
   use scene_stops, only: find_displacement
   use scene_types, only: all_stops, scene_t
   use sweep_settings, only: is_swept, parameter_t, parameter_index, values_given
   use unit_ratios, only: needs_displacement, entries_in_units
   implicit none (type, external)
   private
   public :: read_scene, parse_scene, complain_of_position, complain_of_scene, set_parameter, set_parameters, &
      values_in_words, draft_t

   !> The contents of a scene file before the scene is resolved (checked, completed and made dimensionless).
   type :: draft_t
      type(scene_input_t) :: input
      type(table_t) :: table
      !> For several cases: the scene before it is resolved, to which the values of each case are applied; unallocated:
      !> the file has not been read yet
      type(scene_t), allocatable :: scene
      !> For several cases: index of the entry of each parameter in the table; 0: `set_parameter` sets the parameter
      integer, allocatable :: places(:)
      !> For several cases: indices of the entries in units whose ratios depend on the parameters
      integer, allocatable :: affected(:)
      !> Whether the unit of displacement D depends on the parameters
      logical :: changes_displacement_unit = .false.
   end type draft_t

contains

   !> Read a scene from a file.
   subroutine read_scene(file, scene, error, program)
      character(*), intent(in) :: file
      !> The resolved scene
      type(scene_t), intent(out) :: scene
      !> The first problem, a message of one line; unallocated: no problem
      type(failure_t), allocatable, intent(out) :: error
      !> The program that reads the scene, one of the `program_` constants; absent: any
      integer, intent(in), optional :: program

      character(:), allocatable :: text, problem

      call load_text(file, text, problem)
      if (allocated(problem)) then
         call fail(error, status_bad_input, trim(file)//': '//problem)
         return
      end if
      call parse_scene(text, trim(file), scene, error, program)
   end subroutine read_scene

   !> Read a scene from a text.
   subroutine parse_scene(text, file, scene, error, program)
      character(*), intent(in) :: text
      !> Name of the file of the text, for messages and as the name of the scene
      character(*), intent(in) :: file
      !> The resolved scene
      type(scene_t), intent(out) :: scene
      !> The first problem, a message of one line; unallocated: no problem
      type(failure_t), allocatable, intent(out) :: error
      !> The program that reads the scene, one of the `program_` constants; absent: any
      integer, intent(in), optional :: program

      type(draft_t) :: draft
      character(:), allocatable :: problem
      integer :: reader

      reader = program_any
      if (present(program)) reader = program
      call read_draft(text, file, reader, draft, scene, problem)
      if (.not. allocated(problem)) then
         if (.not. draft%input%has_problem()) call resolve_scene(draft%input, draft%table, reader, scene)
         if (.not. allocated(scene%title)) scene%title = scene%name
         if (.not. draft%input%has_problem()) call check_extremes(draft%input, scene)
         if (.not. draft%input%has_problem()) call make_echo(draft%table, scene)
         call draft%input%get_problem(problem)
      end if
      if (allocated(problem)) call fail(error, status_bad_input, problem)
   end subroutine parse_scene

   !> Read the values of a scene from a text, without resolving the scene.
   subroutine read_draft(text, file, program, draft, scene, problem)
      character(*), intent(in) :: text
      character(*), intent(in) :: file
      !> Program that reads the file: one of the `program_` constants, or a sum of several
      integer, intent(in) :: program
      type(draft_t), intent(out) :: draft
      !> The scene, not resolved
      type(scene_t), intent(inout) :: scene
      !> Syntax error of the text; unallocated: none
      character(:), allocatable, intent(out) :: problem

      type(namelist_t) :: namelist
      character(:), allocatable :: name
      integer :: i, line

      scene%file = file
      scene%text = text
      ! name of the file without folders and extension
      name = file(index(file, '/', back=.true.) + 1:)
      i = index(name, '.', back=.true.)
      if (i > 1) name = name(:i - 1)
      scene%name = name
      call parse_namelist(text, namelist, line, problem)
      if (allocated(problem)) then
         problem = file//':'//to_text(line)//': '//problem
         return
      end if
      call read_into_table(draft%input, draft%table, omits_absent=.true.)
      if (draft%input%has_problem()) then
         ! the hints of messages need the names of all groups
         draft%input = scene_input_t()
         draft%table = table_t()
         call read_into_table(draft%input, draft%table, omits_absent=.false.)
      end if
      call draft%table%begin_copy_to_scene()
      call list_scene(draft%table, scene)

   contains

      !> List the names in the table and read the values of the file into it.
      subroutine read_into_table(input, table, omits_absent)
         type(scene_input_t), intent(inout) :: input
         type(table_t), intent(inout) :: table
         !> Whether the table omits the names of groups that stand alone and that the file does not have
         logical, intent(in) :: omits_absent

         table%omits_absent = omits_absent
         call input%start(file, namelist, table)
         call list_scene(table, scene)
         call input%read_table(table, program)
      end subroutine read_into_table

   end subroutine read_draft

   !> Report a problem that was found after a scene was read, with its position in the scene file.
   subroutine complain_of_scene(scene, group, name, problem, error, occurrence)
      type(scene_t), intent(in) :: scene
      character(*), intent(in) :: group
      !> The name, or several names for one quantity, separated by blanks
      character(*), intent(in) :: name
      character(*), intent(in) :: problem
      !> Message with file, line, group, name and value
      type(failure_t), allocatable, intent(inout) :: error
      !> Number of the group among several of this name; absent: the first
      integer, intent(in), optional :: occurrence

      type(scene_input_t) :: input
      type(namelist_t) :: namelist
      character(:), allocatable :: message
      integer :: line

      call parse_namelist(scene%text, namelist, line, message)
      call input%start(scene%file, namelist)
      call input%complain(group, name, problem, occurrence)
      call input%get_problem(message)
      call fail(error, status_bad_input, message)
   end subroutine complain_of_scene

   !> Report a position without a node, in the line of the support, mass, body or stop that has it, or a beam that
   !> begins beyond a surface, in the line of the body or stop with this surface.
   subroutine complain_of_position(scene, modified, subject, message, error)
      !> The scene as read
      type(scene_t), intent(in) :: scene
      !> The scene with the parameter values of this run
      type(scene_t), intent(in) :: modified
      !> Description of the run, the start of the message
      character(*), intent(in) :: subject
      !> Message that begins with the position or with the beam
      character(*), intent(in) :: message
      type(failure_t), allocatable, intent(inout) :: error

      character(:), allocatable :: group
      type(stop_settings_t), allocatable :: stops(:)
      integer :: occurrence

      group = 'stop'
      occurrence = 1
      allocate (stops, source=all_stops(modified))
      call find_position('stop', stops%position)
      if (index(message, 'the position ') == 1) then
         if (allocated(modified%supports)) call find_position('support', modified%supports%position)
         if (allocated(modified%masses)) call find_position('mass', modified%masses%position)
      end if
      if (allocated(modified%bodies)) call find_position('body', modified%bodies%position)
      call complain_of_scene(scene, group, '', subject//message, error, occurrence)

   contains

      !> Look for the position of the message among those of a kind of groups.
      subroutine find_position(name, positions)
         character(*), intent(in) :: name
         real(wp), intent(in) :: positions(:)

         integer :: k

         do k = 1, size(positions)
            if (index(message, 'the position '//to_text(positions(k))//' ') /= 1 .and. &
               index(message, ' surface at x/L = '//to_text(positions(k))//', by ') == 0) cycle
            group = name
            occurrence = k
         end do
      end subroutine find_position

   end subroutine complain_of_position

   !> Change the values of parameters in a scene that has been read.
   subroutine set_parameters(scene, parameters, values, problem, draft, previous)
      type(scene_t), intent(inout) :: scene
      !> All parameters whose values differ from those in the file
      type(parameter_t), intent(in) :: parameters(:)
      real(wp), intent(in) :: values(:)
      !> Why the values are not allowed; unallocated: they are allowed
      character(:), allocatable, intent(out) :: problem
      !> Contents of the scene file, stored between calls with the same scene and parameters so that the file is read
      !> only once
      type(draft_t), intent(inout), optional :: draft
      !> Values that the scene has from an earlier call with the same parameters; absent: the scene has none
      real(wp), intent(in), optional :: previous(:)

      ! allocated, because the type is large and stacks of threads are small
      type(draft_t), allocatable :: new_draft
      ! the scene has the value of the parameter already
      logical :: is_set(size(parameters))
      logical :: uses_file
      integer :: k

      uses_file = any(parameters%quantity /= '' .or. parameters%changes_scales) .or. scene%has_inconsistent_cases
      if (uses_file .and. present(draft)) then
         call set_by_file(scene, parameters, values, draft, problem)
      else if (uses_file) then
         allocate (new_draft)
         call set_by_file(scene, parameters, values, new_draft, problem)
      end if
      if (allocated(problem)) return
      is_set = .false.
      if (present(previous)) is_set = abs(values - previous) <= 0.0_wp .and. .not. uses_file
      do k = 1, size(parameters)
         if (is_set(k)) cycle
         if (parameters(k)%name == 'taper' .or. .not. uses_file) call set_parameter(scene, parameters(k), values(k))
      end do
   end subroutine set_parameters

   !> Change the value of one dimensionless parameter in a scene that has been read.
   subroutine set_parameter(scene, parameter, value)
      type(scene_t), intent(inout) :: scene
      type(parameter_t), intent(in) :: parameter
      real(wp), intent(in) :: value

      type(table_t) :: table

      call table%begin_copy_of_one(parameter%occurrence, trim(parameter%name_in_group), value)
      call list_group(trim(parameter%group), table, scene)
      if (parameter%name /= 'taper') return
      ! the mean height is that of the scales, because a mean of the current heights would have rounding errors that
      ! depend on previous tapers
      associate (beam => scene%beam, mean => scene%scales%height_ratio*scene%beam%length)
         beam%height_root = mean + 0.5_wp*value*beam%length
         beam%height_tip = mean - 0.5_wp*value*beam%length
         ! a full wedge within rounding
         if (beam%height_tip < min_tip_ratio*mean) beam%height_tip = 0.0_wp
      end associate
   end subroutine set_parameter

   !> Change the values of parameters as if they were given in the scene file, because a value in units can change the
   !> ratios of other quantities. The scene is resolved anew in the first call, and in each call if the values of some
   !> cases may be inconsistent.
   subroutine set_by_file(scene, parameters, values, draft, problem)
      type(scene_t), intent(inout) :: scene
      type(parameter_t), intent(in) :: parameters(:)
      real(wp), intent(in) :: values(:)
      !> Contents of the scene file; empty in the first call
      type(draft_t), intent(inout) :: draft
      character(:), allocatable, intent(out) :: problem

      type(scene_t) :: resolved
      logical :: resolves_anew
      integer :: k

      resolves_anew = scene%has_inconsistent_cases .or. any(parameters%changes_scales) .or. &
         .not. allocated(draft%scene)
      if (.not. allocated(draft%scene)) call read_for_cases(scene, parameters, draft, problem)
      do k = 1, size(parameters)
         if (draft%places(k) > 0) call draft%table%change(draft%places(k), [values(k)])
      end do
      if (resolves_anew) then
         resolved = draft%scene
         call copy_changes_to_scene(draft%table, resolved)
         call resolve_scene(draft%input, draft%table, program_any, resolved)
      else
         if (draft%changes_displacement_unit) call find_displacement(draft%input, draft%table, scene)
         if (.not. draft%input%has_problem()) call resolve_units(draft%input, draft%table, draft%affected, scene)
      end if
      call draft%input%get_problem(problem)
      if (allocated(problem)) then
         ! the number of the line is removed from the message, because the value is not in this line of the file
         problem = problem(len(scene%file) + 2:)
         k = 0
         if (problem(1:1) /= ' ') k = index(problem, ':')
         problem = problem(k + 2:)
      else if (resolves_anew) then
         resolved%title = scene%title
         resolved%output = scene%output
         resolved%fit = scene%fit
         resolved%wants_fit = scene%wants_fit
         resolved%wants_sweep = scene%wants_sweep
         resolved%wants_cases = scene%wants_cases
         resolved%has_inconsistent_cases = scene%has_inconsistent_cases
         if (scene%wants_sweep) resolved%spectrum%resolution = scene%spectrum%resolution
         if (scene%mesh%found%finer_elements > 0) resolved%mesh = scene%mesh
         if (allocated(scene%echo)) resolved%echo = scene%echo
         scene = resolved
      end if
   end subroutine set_by_file

   !> Read a scene file for several cases: the parameters count as given by the file.
   subroutine read_for_cases(scene, parameters, draft, problem)
      type(scene_t), intent(in) :: scene
      type(parameter_t), intent(in) :: parameters(:)
      type(draft_t), intent(inout) :: draft
      character(:), allocatable, intent(out) :: problem

      type(scene_t) :: unresolved
      integer, allocatable :: all(:)
      integer :: k

      call read_draft(scene%text, scene%file, program_any, draft, unresolved, problem)
      unresolved%wants_sweep = .false.
      unresolved%wants_cases = .false.
      unresolved%wants_sensitivity = .false.
      unresolved%wants_fit = .false.
      unresolved%wants_uncertainty = .false.
      allocate (draft%scene, source=unresolved)
      allocate (draft%places(size(parameters)), source=0)
      associate (table => draft%table)
         do k = 1, size(parameters)
            ! a change of the taper preserves the mean height, whatever the file gives for the section, so it is set
            ! directly and not as if the file gave it
            if (parameters(k)%name == 'taper') cycle
            associate (parameter => parameters(k))
               call draft%input%add(trim(parameter%group), trim(parameter%name_in_group), parameter%occurrence)
               draft%places(k) = table%find(table%find_group(parameter%group, parameter%occurrence), &
                  parameter%name_in_group)
               table%entries(draft%places(k))%is_given = .true.
            end associate
         end do
         all = entries_in_units(table)
         associate (entries => table%entries, places => pack(draft%places, draft%places > 0))
            draft%changes_displacement_unit = any(needs_displacement(entries(places)))
            ! ratios can refer to another quantity of the same group
            draft%affected = pack(all, [(any(entries(places)%group == entries(all(k))%group), k=1, size(all))] .or. &
               (draft%changes_displacement_unit .and. needs_displacement(entries(all))))
         end associate
      end associate
   end subroutine read_for_cases

   !> Check that the minimum and maximum values of a sweep or of &cases give valid scenes. Problems with quantities in
   !> units and with &cases are reported to `input`. If dimensionless values of a sweep give problems,
   !> `has_inconsistent_cases` is set, and each case in which they occur fails with its own message.
   subroutine check_extremes(input, scene)
      type(scene_input_t), intent(inout) :: input
      !> Resolved scene
      type(scene_t), intent(inout) :: scene

      type(parameter_t), allocatable :: parameters(:)
      character(:), allocatable :: problem
      real(wp), allocatable :: extremes(:, :)
      real(wp) :: spacing
      logical, allocatable :: must_be_valid(:)
      integer :: k

      if (.not. (scene%wants_sweep .or. scene%wants_cases)) return
      associate (swept => scene%sweep%swept)
         parameters = pack(swept%parameter, is_swept(swept))
         allocate (extremes(2, size(parameters)))
         do k = 1, size(parameters)
            associate (all => values_given(swept(parameter_index(trim(parameters(k)%name), swept))))
               extremes(:, k) = [minval(all), maxval(all)]
            end associate
         end do
      end associate
      must_be_valid = parameters%quantity /= '' .or. scene%wants_cases
      call try_corners(scene, pack(parameters, must_be_valid), reshape(pack(extremes, spread(must_be_valid, 1, 2)), &
         [2, count(must_be_valid)]), problem, spacing)
      if (allocated(problem)) then
         k = findloc(must_be_valid, .true., dim=1)
         call input%complain(trim(merge('sweep', 'cases', scene%wants_sweep)), trim(parameters(k)%name) &
            //' '//trim(parameters(k)%name)//'_range '//trim(parameters(k)%name)//'_log_range values', problem)
      else if (scene%wants_sweep) then
         call try_corners(scene, parameters, extremes, problem, spacing)
         scene%has_inconsistent_cases = allocated(problem)
         ! all cases have the frequencies of the longest case, because the default spacing of a shorter one misses lines
         if (.not. spacing < huge(spacing)) spacing = spacing_of_spectrum(scene)
         scene%spectrum%resolution = spacing
      end if
   end subroutine check_extremes

   !> Resolve the scenes at the corners of the parameter ranges (minimum or maximum of each parameter), and find the
   !> first problem.
   subroutine try_corners(scene, parameters, extremes, problem, spacing)
      type(scene_t), intent(in) :: scene
      type(parameter_t), intent(in) :: parameters(:)
      !> Minimum and maximum value, [2, parameters]
      real(wp), intent(in) :: extremes(:, :)
      !> Message with the values; unallocated: no problem
      character(:), allocatable, intent(out) :: problem
      !> Minimum spacing over omega1 of the frequencies of their spectra; huge: no scene without a problem
      real(wp), intent(out) :: spacing

      ! only corners of six parameters are checked: parameter k + 6 has its minimum or maximum together with parameter
      ! k; bit k - 1 of `corner` selects the maximum
      integer, parameter :: max_checked = 6
      type(draft_t), allocatable :: draft
      type(scene_t) :: corner_scene
      character(:), allocatable :: corner_problem
      real(wp) :: values(size(parameters))
      integer :: corner, k

      spacing = huge(spacing)
      if (size(parameters) == 0) return
      allocate (draft)
      do corner = 0, 2**min(size(parameters), max_checked) - 1
         values = [(extremes(1 + ibits(corner, modulo(k - 1, max_checked), 1), k), k=1, size(parameters))]
         corner_scene = scene
         corner_scene%has_inconsistent_cases = .true.
         call set_parameters(corner_scene, parameters, values, corner_problem, draft)
         if (.not. allocated(corner_problem)) then
            spacing = min(spacing, spacing_of_spectrum(corner_scene))
         else if (.not. allocated(problem)) then
            problem = values_in_words(parameters, values)//': '//corner_problem
         end if
      end do
   end subroutine try_corners

   !> The values of parameters, such as 'preload = 0.1, zeta = 0.01'.
   pure function values_in_words(parameters, values) result(words)
      type(parameter_t), intent(in) :: parameters(:)
      !> [parameters]
      real(wp), intent(in) :: values(:)
      character(:), allocatable :: words

      integer :: k

      words = ''
      do k = 1, size(parameters)
         words = words//', '//trim(parameters(k)%name)//' = '//to_text(values(k))
      end do
      words = words(3:)
   end function values_in_words

   !> Spacing over omega1 of the frequencies of a scene's spectrum; 0: the scene has none.
   pure real(wp) function spacing_of_spectrum(scene) result(spacing)
      type(scene_t), intent(in) :: scene

      spacing = 0.0_wp
      if (scene%wants_spectrum) spacing = scene%spectrum%frequency_spacing(min(scene%spectrum%end, &
         end_of_run(scene%response)) - scene%spectrum%start)
   end function spacing_of_spectrum

end module scene_reader
