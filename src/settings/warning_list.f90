!> Warnings about plausibility: a scene may be meant differently from what it says, but it is computed. Each warning has
!> a name by which a scene silences it.
module warning_list
   implicit none (type, external)
   private
   public :: warning_t, warning_names
   public :: warning_height, warning_frequency, warning_position, warning_tau, warning_twins, warning_start
   public :: warning_stiffness, warning_name, warning_slope, warning_strength, warning_cycles

   !> Indices of the warnings in `warning_names`.
   integer, parameter :: warning_height = 1
   integer, parameter :: warning_frequency = 2
   integer, parameter :: warning_position = 3
   integer, parameter :: warning_tau = 4
   integer, parameter :: warning_twins = 5
   integer, parameter :: warning_start = 6
   integer, parameter :: warning_stiffness = 7
   integer, parameter :: warning_name = 8
   integer, parameter :: warning_slope = 9
   integer, parameter :: warning_strength = 10
   integer, parameter :: warning_cycles = 11
   !> Names with which `silent_warnings` of &scene silences warnings.
   character(*), parameter :: warning_names(11) = [character(16) :: 'height', 'first_frequency', 'position', 'tau', &
      'identical_stops', 'start', 'youngs_modulus', 'former_name', 'slope', &
      'strength', 'cycles']

   !> A warning about a scene.
   type :: warning_t
      !> Index in `warning_names`
      integer :: kind = 0
      !> One sentence, without the name. The length is fixed, because gfortran 12 leaks texts of deferred length if
      !> arrays of this type grow
      character(240) :: text = ''
   end type warning_t

end module warning_list
