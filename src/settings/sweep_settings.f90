!> What a sweep varies: the parameters, and the settings of &sweep and &best.
module sweep_settings
   use kinds, only: wp
   use measure_list, only: measure_quiet
   implicit none (type, external)
   private
   public :: parameter_count, parameter_names, parameter_meanings, is_of_beam, is_swept, parameter_elements, &
      parameter_mesh_ratio, parameter_taper, parameter_tip_mass, parameter_position, parameter_duration, &
      parameter_hop_tolerance, parameter_zeta, parameter_preload, parameter_restitution, parameter_stiffness, &
      parameter_branch, parameter_damper
   public :: swept_t, sweep_settings_t, best_settings_t
   public :: design_grid, design_paired, design_latin_hypercube, design_names
   public :: goal_least, goal_most, goal_names

   integer, parameter :: name_room = 32
   integer, parameter :: meaning_room = 100

   !> Parameters; those of the beam and its mesh come first, so that in a grid they vary slowest.
   integer, parameter :: parameter_elements = 1
   integer, parameter :: parameter_mesh_ratio = 2
   integer, parameter :: parameter_taper = 3
   integer, parameter :: parameter_tip_mass = 4
   integer, parameter :: parameter_position = 5
   integer, parameter :: parameter_duration = 6
   integer, parameter :: parameter_hop_tolerance = 7
   integer, parameter :: parameter_zeta = 8
   integer, parameter :: parameter_preload = 9
   integer, parameter :: parameter_restitution = 10
   integer, parameter :: parameter_stiffness = 11
   integer, parameter :: parameter_branch = 12
   integer, parameter :: parameter_damper = 13
   integer, parameter :: parameter_count = 13
   character(*), parameter :: parameter_names(parameter_count) = [character(name_room) :: &
      'elements', 'mesh_ratio', 'taper', 'tip_mass_ratio', 'position', 'duration', 'hop_tolerance', 'zeta', &
      'preload', 'restitution', 'stiffness_ratio', 'branch_ratio', 'damper_ratio']
   character(*), parameter :: parameter_meanings(parameter_count) = [character(meaning_room) :: &
      'number of elements', 'ratio of neighbouring elements', 'alpha = (height_root - height_tip) / length, mean height kept', &
      'mu = tip mass over mass of the beam', 'position of the stop Lc over length', 'length of the run, tau', &
      'eta that a flight must exceed to be no rest', 'damping ratio', 'delta = d / (y_c(0) - d)', &
      'coefficient of restitution eps', 'kappa = k / (3 E Ibar / L^3)', 'beta = spring of the Maxwell branch over k', &
      'c* = c omega1 / (3 E Ibar / L^3)']

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

   !> The values of one parameter; it is not swept if nothing is given.
   type :: swept_t
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
      !> Parameters, by the `parameter_` constants
      type(swept_t) :: swept(parameter_count)
      !> Latin hypercube: number of cases, and what its random numbers start from
      integer :: count = 0
      integer :: seed = 1
      !> Cases to a part, the unit in which results reach the disk; 0: chosen by the number of cases
      integer :: part_cases = 0
   end type sweep_settings_t

   !> &best
   type :: best_settings_t
      !> Place in the table of measures of the one by which cases are compared
      integer :: measure = measure_quiet
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

contains

   !> Does another value make another beam or mesh?
   elemental function is_of_beam(parameter) result(is)
      !> One of the `parameter_` constants
      integer, intent(in) :: parameter
      logical :: is

      is = parameter <= parameter_position
   end function is_of_beam

   !> Does a sweep give this parameter values?
   elemental function is_swept(swept) result(is)
      !> What it gives
      type(swept_t), intent(in) :: swept
      logical :: is

      is = allocated(swept%list) .or. allocated(swept%range) .or. allocated(swept%log_range)
   end function is_swept

end module sweep_settings
