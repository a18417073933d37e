!> Warnings about implausible values. A scene with warnings is computed. A scene silences a warning by its name.
module warning_list
   implicit none (type, external)
   private
   public :: warning_t, warning_names
   public :: warning_thick_beam, warning_first_frequency, warning_position_ratio, warning_dimensionless_time, &
      warning_identical_stops, warning_default_start
   public :: warning_youngs_modulus, warning_former_name, warning_large_slope, warning_over_strength
   public :: warning_uncounted_cycles, warning_table_end, warning_stress_start, warning_settling, warning_impacts

   !> Indices of the warnings in `warning_names`. The beam is so thick that shear, which the theory neglects, is not
   !> small.
   integer, parameter :: warning_thick_beam = 1
   !> The first frequency of the beam is implausible in Hz.
   integer, parameter :: warning_first_frequency = 2
   !> A position x/L is so small that it may have been meant as a length.
   integer, parameter :: warning_position_ratio = 3
   !> A dimensionless time may have been meant as a time in units.
   integer, parameter :: warning_dimensionless_time = 4
   !> Two &stop groups are equal.
   integer, parameter :: warning_identical_stops = 5
   !> A beam between stops is released from a deflection by default, without &start.
   integer, parameter :: warning_default_start = 6
   !> Young's modulus is outside the range of materials.
   integer, parameter :: warning_youngs_modulus = 7
   !> A measure is requested by its former name, or a rigid stop has no such measure.
   integer, parameter :: warning_former_name = 8
   !> The slope of the deflected beam exceeds the range of the linear theory.
   integer, parameter :: warning_large_slope = 9
   !> The maximum stress exceeds the given strength.
   integer, parameter :: warning_over_strength = 10
   !> Cycles of stresses are counted only to the instant at which there are too many turning points.
   integer, parameter :: warning_uncounted_cycles = 11
   !> The table of a load ends during the run, with a value that is not zero, so that the load jumps to zero.
   integer, parameter :: warning_table_end = 12
   !> An extreme of the stress lies at the start, where the velocity does not fulfil the conditions at the root or a
   !> support: the damping moment has no limit on finer meshes.
   integer, parameter :: warning_stress_start = 13
   !> The run ends so soon after the settling time that the beam may exceed the settling level again.
   integer, parameter :: warning_settling = 14
   !> The statistics of a contact count so many impacts that these are the parts of a few closings.
   integer, parameter :: warning_impacts = 15
   !> Names by which users see and silence (`silent_warnings` of &scene) the warnings.
   character(*), parameter :: warning_names(15) = [character(16) :: 'height', 'first_frequency', 'position', 'tau', &
      'identical_stops', 'start', 'youngs_modulus', 'former_name', 'slope', &
      'strength', 'cycles', 'table_end', 'stress_start', 'settling', 'impacts']

   !> A warning about a scene.
   type :: warning_t
      !> Index in `warning_names`
      integer :: kind = 0
      !> One sentence, without the name. The length is fixed, because gfortran 12 leaks texts of deferred length if
      !> arrays of this type grow
      character(240) :: text = ''
   end type warning_t

end module warning_list
