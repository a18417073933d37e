!> The names of a table that a sweep or &cases may vary, and the names of &sweep.
module sweep_names
   use kinds, only: wp
   use load_settings, only: base_displacement
   use name_table, only: table_t
   use name_types, only: condition_t, kind_whole, name_t, sweep_t, range_t
   use run_settings, only: name_length
   use scene_types, only: support_rotation
   use sorting, only: ascending_order
   use sweep_settings, only: design_names, parameter_t, sweep_settings_t
   implicit none (type, external)
   private
   public :: find_parameters, parameter_of, parameter_names, chosen_parameter, quantity_of, sweep_of, list_sweep, &
      max_cases, unswept

   !> Offset between the numbers of a parameter in successive groups of one name; larger than the `order` of any name in
   !> its `sweep_t`, so that no two parameters have the same number.
   integer, parameter :: group_offset = 100

   !> Maximum number of cases of a sweep
   integer, parameter :: max_cases = 1000000000
   !> Default value, in words, of the names of parameters in &sweep
   character(*), parameter :: unswept = 'not swept'

   !> Condition of names that only a Latin hypercube has.
   type(condition_t), parameter :: hypercube = condition_t(name='design', words='latin_hypercube')

contains

   !> Find the entries that a sweep may vary, in the order of the axes of a grid: parameters that change the beam come
   !> first, so that each beam is computed once.
   pure subroutine find_parameters(table, places)
      class(table_t), intent(in) :: table
      !> Indices of these entries
      integer, allocatable, intent(out) :: places(:)

      type(sweep_t) :: sweeps(table%entry_count)
      integer :: i

      sweeps = [(sweep_of(table, i), i=1, table%entry_count)]
      places = pack([(i, i=1, table%entry_count)], sweeps%order > 0)
      ! the order, with parameters that do not change the beam after all others
      places = places(ascending_order(real(sweeps(places)%order, wp) + merge(0.0_wp, real(huge(1), wp), &
         sweeps(places)%changes_beam)))
   end subroutine find_parameters

   !> Use of an entry as a parameter; an entry in units is used in the same way as the ratio that it replaces.
   pure type(sweep_t) function sweep_of(table, place) result(sweep)
      class(table_t), intent(in) :: table
      !> Index of the entry
      integer, intent(in) :: place

      ! offset between the number of a ratio and that of the same parameter in units, so that each has its own sequence
      ! of random numbers; the second entry in units for one ratio has twice this offset
      integer, parameter :: units_offset = 1000000
      integer :: i

      associate (entry => table%entries(place), name => table%entries(place)%name)
         sweep = name%sweep
         if (name%quantity == '' .or. name%instead_of == '') return
         i = table%find(entry%group, name%instead_of)
         sweep = table%entries(i)%name%sweep
         sweep%name = name%sweep%name
         ! the meaning of the ratio may name the scale of the ratio; the entry in units has its own meaning
         sweep%meaning = ''
         if (sweep%order == 0) return
         do i = table%groups(entry%group)%first_entry, place
            if (table%entries(i)%name%instead_of == name%instead_of) sweep%order = sweep%order + units_offset
         end do
      end associate
   end function sweep_of

   !> Description of an entry as a parameter of a sweep.
   pure type(parameter_t) function parameter_of(table, place) result(parameter)
      class(table_t), intent(in) :: table
      !> Index of the entry
      integer, intent(in) :: place

      type(sweep_t) :: sweep

      sweep = sweep_of(table, place)
      associate (entry => table%entries(place))
         parameter = parameter_t(name=entry%name%name, meaning=entry%name%meaning, &
            group=table%groups(entry%group)%name, occurrence=table%groups(entry%group)%occurrence, &
            name_in_group=entry%name%name, changes_beam=sweep%changes_beam, &
            changes_contacts=any(table%groups(entry%group)%name == [character(4) :: 'stop', 'body']), &
            changes_scales=sweep%changes_scales, &
            may_change_in_motion=sweep%may_change_in_motion, is_whole=entry%kind == kind_whole, &
            quantity=entry%name%quantity, allowed=[entry%name%range%minimum, entry%name%range%maximum])
         parameter%order = sweep%order + group_offset*(parameter%occurrence - 1)
         if (sweep%name /= '') parameter%name = sweep%name
         associate (group => table%groups(entry%group))
            if (group%label /= group%name) parameter%name = trim(group%label)//'_'//parameter%name
         end associate
         if (sweep%meaning /= '') parameter%meaning = sweep%meaning
         if (parameter%quantity /= '') parameter%quantity = quantity_of(table, place)
      end associate
   end function parameter_of

   !> Names of parameters in &sweep.
   pure function parameter_names(table, places) result(names)
      class(table_t), intent(in) :: table
      !> Indices of their entries
      integer, intent(in) :: places(:)
      character(name_length) :: names(size(places))

      type(parameter_t) :: parameter
      integer :: k

      do k = 1, size(places)
         parameter = parameter_of(table, places(k))
         names(k) = parameter%name
      end do
   end function parameter_names

   !> Quantity of an entry in units; for some names the quantity depends on other names of the group.
   pure function quantity_of(table, place) result(quantity)
      class(table_t), intent(in) :: table
      !> Index of the entry
      integer, intent(in) :: place
      character(:), allocatable :: quantity

      integer :: group

      group = table%entries(place)%group
      quantity = trim(table%entries(place)%name%quantity)
      select case (trim(table%groups(group)%name)//' '//trim(table%entries(place)%name%name))
      case ('support stiffness')
         if (has_word('motion', support_rotation)) quantity = 'rotational_stiffness'
      case ('base amplitude')
         if (has_word('quantity', base_displacement)) quantity = 'displacement'
      case ('force amplitude')
         if (table%entries(table%find(group, 'stretch'))%is_given .or. &
            table%entries(table%find(group, 'stretch_length'))%is_given) quantity = 'line_load'
      end select

   contains

      !> Whether the value of a name is this word.
      pure logical function has_word(name, word)
         character(*), intent(in) :: name
         !> Index of the word
         integer, intent(in) :: word

         has_word = nint(table%entries(table%find(group, name))%value) == word
      end function has_word

   end function quantity_of

   !> Index of the parameter whose name is the value of an entry, such as `parameter` of &cases; 0: the entry has no
   !> value.
   pure integer function chosen_parameter(table, group, name) result(place)
      class(table_t), intent(in) :: table
      !> Index of the group of this entry
      integer, intent(in) :: group
      !> Name of this entry
      character(*), intent(in) :: name

      type(parameter_t) :: candidate
      integer, allocatable :: places(:)
      integer :: i

      place = 0
      associate (entry => table%entries(table%find(group, name)))
         if (nint(entry%value) == 0) return
         call find_parameters(table, places)
         do i = 1, size(places)
            candidate = parameter_of(table, places(i))
            if (candidate%name == entry%words(nint(entry%value))) place = places(i)
         end do
      end associate
   end function chosen_parameter

   !> List the names of &sweep in the table, and bind them to the components of the scene: for each parameter a list of
   !> values, and for each real parameter also the names of its ranges.
   subroutine list_sweep(table, sweep)
      class(table_t), intent(inout) :: table
      type(sweep_settings_t), intent(inout) :: sweep

      integer, allocatable :: places(:)
      type(name_t) :: name
      integer :: k

      call table%bind(sweep%design, name_t('design', 'combinations of the values: all, the i-th values of all lists ' &
         //'together, or a random sample'), design_names)
      call table%bind(sweep%count, name_t('count', 'number of cases', range_t(1, max_cases), hypercube, &
         default='none'))
      call table%bind(sweep%seed, name_t('seed', 'start of the random numbers', range_t(1, 2000000000), hypercube))
      call table%bind(sweep%chunk_cases, name_t('part_cases', 'number of cases stored together', &
         range_t(1, 1000000), default='a 400th of the cases, 10 to 16384'))
      call find_parameters(table, places)
      ! allocated already: the scene has been read before, and keeps its values
      if (.not. allocated(sweep%swept)) allocate (sweep%swept(size(places)))
      do k = 1, size(places)
         sweep%swept(k)%parameter = parameter_of(table, places(k))
      end do
      call table%bind(sweep%carry, name_t('carry', 'swept parameter that may change during a motion: damping, ' &
         //'law of a stop, loads; along its values each case starts from the ' &
         //'final state of the preceding case', default='none: each case by itself', is_optional=.true.), &
         sweep%swept%parameter%name)
      call table%bind(sweep%tied, name_t('tied', 'swept parameters that vary together, value by value, as one ' &
         //'axis of the grid', default='none', is_optional=.true.), sweep%swept%parameter%name)
      call table%bind(sweep%carries_back, name_t('carry_back', 'go through the values of carry and back again'))
      do k = 1, size(places)
         associate (swept => sweep%swept(k))
            name = name_t(swept%parameter%name, swept%parameter%meaning, default=unswept, is_optional=.true.)
            name%range = table%entries(places(k))%name%range
            name%needs = table%entries(places(k))%name%needs
            ! A condition on names refers to the group of the parameter. A parameter without condition needs its group
            ! if it has no value without the group: in groups that repeat, and in &root, &section and &stress. In all
            ! other groups a name has its default value without the group
            if (name%needs%name /= '' .or. name%needs%phrase /= '') then
               name%needs%group = table%groups(table%entries(places(k))%group)%name
               name%needs%occurrence = swept%parameter%occurrence
            else if (table%groups(table%entries(places(k))%group)%repeats) then
               name%needs = condition_t(group=swept%parameter%group, occurrence=swept%parameter%occurrence)
            else if (any(swept%parameter%group == [character(7) :: 'root', 'section', 'stress'])) then
               name%needs = condition_t(group=swept%parameter%group)
            end if
            call table%bind(swept%list, name, are_whole=swept%parameter%is_whole)
            if (swept%parameter%is_whole) cycle
            name%name = trim(swept%parameter%name)//'_range'
            name%meaning = 'minimum and maximum, divided evenly'
            call table%bind(swept%range, name)
            name%name = trim(swept%parameter%name)//'_log_range'
            name%meaning = 'the same, divided evenly on a logarithmic scale'
            call table%bind(swept%log_range, name)
            name%name = trim(swept%parameter%name)//'_points'
            name%meaning = 'number of values in the range'
            name%range = range_t(2, 1000000)
            call table%bind(swept%points, name)
         end associate
      end do
   end subroutine list_sweep

end module sweep_names
