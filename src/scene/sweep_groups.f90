!> The names of &sweep.
module sweep_groups
   use name_parameters, only: list_parameters, parameter_of
   use name_table, only: table_t
   use name_types, only: condition_t, name_t
   use run_settings, only: name_length
   use sweep_settings, only: design_names, parameter_t, sweep_settings_t
   use value_rules, only: range_t
   implicit none (type, external)
   private
   public :: list_sweep, most_cases

   integer, parameter :: most_cases = 1000000000

   type(condition_t), parameter :: hypercube = condition_t(name='design', words='latin_hypercube')

contains

   !> Every name that can be swept, as a list, and every number that is not whole as a range too.
   subroutine list_sweep(table, sweep)
      class(table_t), intent(inout) :: table
      type(sweep_settings_t), intent(inout) :: sweep

      integer, allocatable :: places(:)
      type(name_t) :: name
      integer :: k

      call table%bind(sweep%design, name_t('design', 'which combinations of the values: all, the lists side by side, ' &
         //'or a random sample'), design_names)
      call table%bind(sweep%count, name_t('count', 'number of cases', range_t(1, most_cases), hypercube, &
         default='none'))
      call table%bind(sweep%seed, name_t('seed', 'start of the random numbers', range_t(1, 2000000000), hypercube))
      call table%bind(sweep%part_cases, name_t('part_cases', 'cases that reach the disk together', &
         range_t(1, 1000000), default='a 400th, 10 to 16384'))
      call list_parameters(table, places)
      call list_carry(table, places, sweep)
      if (.not. allocated(sweep%swept)) allocate (sweep%swept(size(places)))
      do k = 1, size(places)
         associate (swept => sweep%swept(k))
            swept%parameter = parameter_of(table, places(k))
            name = name_t(swept%parameter%name, swept%parameter%meaning, default='not swept', is_optional=.true.)
            name%range = table%entries(places(k))%name%range
            name%needs = table%entries(places(k))%name%needs
            if (name%needs%name /= '' .or. name%needs%phrase /= '') then
               name%needs%group = swept%parameter%group
               name%needs%occurrence = swept%parameter%occurrence
            else if (table%groups(table%entries(places(k))%group)%repeats) then
               name%needs = condition_t(group=swept%parameter%group, occurrence=swept%parameter%occurrence)
            else if (any(swept%parameter%group == [character(6) :: 'root', 'stress'])) then
               name%needs = condition_t(group=swept%parameter%group)
            end if
            call table%bind(swept%list, name, swept%parameter%is_whole)
            if (swept%parameter%is_whole) cycle
            name%name = trim(swept%parameter%name)//'_range'
            name%meaning = 'least and greatest, divided evenly'
            call table%bind(swept%range, name)
            name%name = trim(swept%parameter%name)//'_log_range'
            name%meaning = 'the same, divided evenly in the logarithm'
            call table%bind(swept%log_range, name)
            name%name = trim(swept%parameter%name)//'_points'
            name%meaning = 'number of values in the range'
            name%range = range_t(2, 1000000)
            call table%bind(swept%points, name)
         end associate
      end do
   end subroutine list_sweep

   !> The names of chains.
   subroutine list_carry(table, places, sweep)
      class(table_t), intent(inout) :: table
      !> Of the parameters
      integer, intent(in) :: places(:)
      type(sweep_settings_t), intent(inout) :: sweep

      character(name_length) :: names(size(places))
      type(parameter_t) :: parameter
      integer :: k

      do k = 1, size(places)
         parameter = parameter_of(table, places(k))
         names(k) = parameter%name
      end do
      call table%bind(sweep%carry, name_t('carry', 'swept parameter along whose values the end of one case is the ' &
         //'start of the next', default='none: each case by itself', is_optional=.true.), names)
      call table%bind(sweep%carries_back, name_t('carry_back', 'go through these values to the end and back again'))
   end subroutine list_carry

end module sweep_groups
