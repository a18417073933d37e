!> Settings of parameter studies: &sweep (many cases, of which only measures are stored), &best (the best cases of a
!> sweep) and &cases (a few runs with their histories), and the parameters that these groups may vary.
module sweep_settings
   use kinds, only: wp
   use measure_list, only: measure_settling
   implicit none (type, external)
   private
   public :: parameter_t, swept_t, sweep_settings_t, best_settings_t
   public :: is_follower, is_swept, parameter_index, value_count_of, values_given, varies_scales
   public :: design_grid, design_paired, design_latin_hypercube, design_names
   public :: goal_maximum, goal_names

   ! maximum lengths of texts
   integer, parameter :: max_name_length = 48
   integer, parameter :: max_meaning_length = 180

   !> A number that a sweep or &cases may vary.
   type :: parameter_t
      !> Name in &sweep and &cases
      character(max_name_length) :: name = ''
      !> Meaning of the parameter
      character(max_meaning_length) :: meaning = ''
      !> Group of the parameter
      character(max_name_length) :: group = ''
      !> Number of this group among the groups of its name
      integer :: occurrence = 1
      !> Name of the parameter in the group
      character(max_name_length) :: name_in_group = ''
      !> Number of the parameter among all that may be swept (`sweep_t` of its entry), which selects its own sequence of
      !> random numbers
      integer :: order = 0
      !> Whether a change of the value changes the beam or the mesh
      logical :: changes_beam = .false.
      !> Whether the value belongs to a contact
      logical :: changes_contacts = .false.
      !> Whether a change of the value changes the scales of the scene, so that the scene is resolved anew for each
      !> value
      logical :: changes_scales = .false.
      !> Whether the value may change during a motion, so that a case can start from the final state of another case
      logical :: may_change_in_motion = .false.
      !> Whether the values are whole numbers
      logical :: is_whole = .false.
      !> Quantity of values in the units of the scene, a name in `quantity_table`; empty: a dimensionless value
      character(max_name_length) :: quantity = ''
      !> Minimum and maximum that scenes may give
      real(wp) :: allowed(2) = [-huge(1.0_wp), huge(1.0_wp)]
   end type parameter_t

   !> Designs of a sweep. Grid: all combinations of the values.
   integer, parameter :: design_grid = 1
   !> Case i has the i-th value of each list.
   integer, parameter :: design_paired = 2
   !> A given number of random cases: each range is divided into this number of strata, with one case in each.
   integer, parameter :: design_latin_hypercube = 3
   character(*), parameter :: design_names(3) = [character(max_name_length) :: 'grid', 'paired', 'latin_hypercube']

   !> The best case has the minimum of the measure.
   integer, parameter :: goal_minimum = 1
   !> The best case has the maximum of the measure.
   integer, parameter :: goal_maximum = 2
   ! words of scene files for the minimum and the maximum
   character(*), parameter :: goal_names(2) = [character(max_name_length) :: 'least', 'most']

   !> A parameter of a sweep or of &cases and its values: `list`, `range` or `log_range`; if none of them is allocated,
   !> the parameter is not varied.
   type :: swept_t
      type(parameter_t) :: parameter
      !> List of the values
      real(wp), allocatable :: list(:)
      !> Minimum and maximum of evenly spaced values
      real(wp), allocatable :: range(:)
      !> Minimum and maximum of values that are evenly spaced on a logarithmic scale
      real(wp), allocatable :: log_range(:)
      !> Number of values in the range; 0: not given
      integer :: points = 0
   end type swept_t

   !> Settings of &sweep.
   type :: sweep_settings_t
      !> One of the `design_` constants
      integer :: design = design_grid
      !> All parameters that can be swept, in the order of the axes of a grid
      type(swept_t), allocatable :: swept(:)
      !> Number of cases of a Latin hypercube
      integer :: count = 0
      !> Seed of the random numbers of a Latin hypercube
      integer :: seed = 1
      !> Number of cases in a chunk, which is written to disk as one file; 0: chosen from the number of cases
      integer :: chunk_cases = 0
      !> Index of the parameter along whose values each case starts from the final state of the preceding case; 0: each
      !> case has its own start
      integer :: carry = 0
      !> Whether the cases run through the values of the parameter `carry` in the given order, and then in reverse order
      logical :: carries_back = .false.
      !> Indices of parameters of a grid that vary together, value by value, as one axis; unallocated: none
      integer, allocatable :: tied(:)
   end type sweep_settings_t

   !> Settings of &best.
   type :: best_settings_t
      !> Index in `measure_table` of the measure by which cases are compared
      integer :: measure = measure_settling
      !> Goal: `goal_minimum` or `goal_maximum`
      integer :: goal = goal_minimum
      !> Number of cases in the table
      integer :: count = 10
      !> Whether to search for better cases between the minimum and the maximum of the swept values of each parameter,
      !> starting from the best case
      logical :: refine = .false.
      !> Refinement: maximum number of cases that are computed
      integer :: evaluations = 2000
      !> Refinement: the search ends when its step is shorter than this fraction of the range of each parameter
      real(wp) :: precision = 1.0e-4_wp
   end type best_settings_t

contains

   !> Whether scales of the scene differ between the values of a parameter: the beam differs, or the height of the stop
   !> from which the beam is released, which determines the unit of displacement.
   elemental logical function varies_scales(parameter)
      type(parameter_t), intent(in) :: parameter

      varies_scales = parameter%changes_scales .or. parameter%quantity == 'displacement'
   end function varies_scales

   !> Index of a parameter in a sweep; 0: no parameter has this name.
   pure integer function parameter_index(name, swept) result(place)
      character(*), intent(in) :: name
      type(swept_t), intent(in) :: swept(:)

      do place = size(swept), 1, -1
         if (swept(place)%parameter%name == name) exit
      end do
   end function parameter_index

   !> Whether a sweep varies this parameter.
   elemental logical function is_swept(swept) result(answer)
      type(swept_t), intent(in) :: swept

      answer = allocated(swept%list) .or. allocated(swept%range) .or. allocated(swept%log_range)
   end function is_swept

   !> Whether a parameter is tied to another parameter that precedes it in the sweep.
   pure logical function is_follower(sweep, place) result(answer)
      type(sweep_settings_t), intent(in) :: sweep
      !> Index of the parameter
      integer, intent(in) :: place

      answer = .false.
      if (allocated(sweep%tied)) answer = any(sweep%tied == place) .and. place > minval(sweep%tied)
   end function is_follower

   !> Number of values of one parameter; the parameter `carry` has each value twice if the cases go forwards and
   !> backwards.
   pure integer function value_count_of(sweep, place) result(values)
      type(sweep_settings_t), intent(in) :: sweep
      !> Index of the parameter
      integer, intent(in) :: place

      values = max(sweep%swept(place)%points, 1)
      if (allocated(sweep%swept(place)%list)) values = size(sweep%swept(place)%list)
      if (place == sweep%carry .and. sweep%carries_back) values = 2*values
   end function value_count_of

   !> Values given for a parameter in a sweep: the list, or only the minimum and the maximum of the range.
   pure function values_given(swept, otherwise) result(values)
      type(swept_t), intent(in) :: swept
      !> Value of the result if the parameter is not swept; absent: the result is then empty
      real(wp), intent(in), optional :: otherwise
      real(wp), allocatable :: values(:)

      if (allocated(swept%list)) then
         allocate (values, source=swept%list)
      else if (allocated(swept%range)) then
         allocate (values, source=swept%range)
      else if (allocated(swept%log_range)) then
         allocate (values, source=swept%log_range)
      else if (present(otherwise)) then
         allocate (values(1), source=otherwise)
      else
         allocate (values(0))
      end if
   end function values_given

end module sweep_settings
