!> What a sweep varies: the parameters, and the settings of &sweep and &best.
module sweep_settings
   use kinds, only: wp
   use measure_list, only: measure_settling
   implicit none (type, external)
   private
   public :: parameter_t, swept_t, sweep_settings_t, best_settings_t, cases_settings_t, is_swept, place_of, values_given
   public :: design_grid, design_paired, design_latin_hypercube, design_names
   public :: goal_most, goal_names

   integer, parameter :: name_room = 48
   integer, parameter :: meaning_room = 180

   !> A number that a sweep or &cases may vary.
   type :: parameter_t
      !> In &sweep and &cases
      character(name_room) :: name = ''
      character(meaning_room) :: meaning = ''
      !> Its own group, which of several of that name, and its name there
      character(name_room) :: group = ''
      integer :: occurrence = 1
      character(name_room) :: name_in_group = ''
      !> Its own number, from which its random numbers start
      integer :: order = 0
      !> Another value makes another beam or mesh
      logical :: is_of_beam = .false.
      !> It may change in a motion under way
      logical :: is_in_motion = .false.
      logical :: is_whole = .false.
      !> What it is, as in `quantity_table`, in the units of the scene; empty: a ratio, or a number
      character(name_room) :: quantity = ''
   end type parameter_t

   !> Every combination of the values.
   integer, parameter :: design_grid = 1
   !> The first values of all lists, the second values, and so on.
   integer, parameter :: design_paired = 2
   !> As many random cases as asked for, each range divided into as many strata with one case in each.
   integer, parameter :: design_latin_hypercube = 3
   character(*), parameter :: design_names(3) = [character(name_room) :: 'grid', 'paired', 'latin_hypercube']

   integer, parameter :: goal_least = 1
   integer, parameter :: goal_most = 2
   character(*), parameter :: goal_names(2) = [character(name_room) :: 'least', 'most']

   !> A parameter and its values; it is not swept if none are given.
   type :: swept_t
      type(parameter_t) :: parameter
      !> Values one by one
      real(wp), allocatable :: list(:)
      !> Least and greatest value
      real(wp), allocatable :: range(:)
      !> The same, to be divided evenly in the logarithm
      real(wp), allocatable :: log_range(:)
      !> Number of values in the range; 0: not given
      integer :: points = 0
   end type swept_t

   !> &sweep
   type :: sweep_settings_t
      !> One of the `design_` constants
      integer :: design = design_grid
      !> All parameters there are, in their order
      type(swept_t), allocatable :: swept(:)
      !> Latin hypercube: number of cases, and what its random numbers start from
      integer :: count = 0
      integer :: seed = 1
      !> Cases to a part, the unit in which results reach the disk; 0: chosen by the number of cases
      integer :: part_cases = 0
      !> Place of the parameter along which each case begins as the one before ended; 0: none
      integer :: carry = 0
      !> Its values are gone through to the end and back
      logical :: carries_back = .false.
   end type sweep_settings_t

   !> &best
   type :: best_settings_t
      !> Place in the table of measures of the one by which cases are compared
      integer :: measure = measure_settling
      !> `goal_least` or `goal_most`
      integer :: goal = goal_least
      !> Number of cases in the table
      integer :: count = 10
      !> Refine from the best case, between the least and the greatest swept value of each parameter
      logical :: refine = .false.
      !> Refinement: most cases to compute
      integer :: evaluations = 2000
      !> Refinement: it ends when the steps are shorter than this share of each range
      real(wp) :: precision = 1.0e-4_wp
   end type best_settings_t

   !> &cases: one scene, run for several values of one parameter, histories kept
   type :: cases_settings_t
      !> Without a name: not given
      type(parameter_t) :: parameter
      !> Its values, one case each
      real(wp), allocatable :: values(:)
   end type cases_settings_t

contains

   !> Place of a parameter in a sweep; 0: there is none of that name.
   pure function place_of(name, swept) result(place)
      character(*), intent(in) :: name
      type(swept_t), intent(in) :: swept(:)
      integer :: place

      do place = size(swept), 1, -1
         if (swept(place)%parameter%name == name) exit
      end do
   end function place_of

   !> Does a sweep give this parameter values?
   elemental function is_swept(swept) result(is)
      type(swept_t), intent(in) :: swept
      logical :: is

      is = allocated(swept%list) .or. allocated(swept%range) .or. allocated(swept%log_range)
   end function is_swept

   !> What a sweep gives for a parameter: a list, or the least and the greatest.
   pure function values_given(swept, otherwise) result(values)
      type(swept_t), intent(in) :: swept
      !> Its value where it is not swept; absent: it has none then
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
