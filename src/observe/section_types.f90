!> State of a motion at an instant, and its Poincare sections: states at intervals of one period of the load
!> (docs/theory.md, section 21).
module section_types
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use tangent_columns, only: tangent_t
   implicit none (type, external)
   private
   public :: section_state_t, run_sections_t

   !> Complete state of a motion, from which another run can continue. Contacts are in the order in which `contacts_of`
   !> (module `stop_contacts`) lists them, not in the order of the scene.
   type :: section_state_t
      !> Instant of the state
      real(wp) :: tau = 0.0_wp
      !> Displacements. With the exact method, of the modes of the beam with all contacts open (free modes), [modes];
      !> with Newmark's method, of the n degrees of freedom, padded with three zeros at both ends, [-2 : n + 3].
      !> Unallocated: there is no state
      real(wp), allocatable :: q(:)
      !> Velocities, as `q`
      real(wp), allocatable :: v(:)
      !> Modes of `q`, of which some are residual modes (shapes that replace the omitted modes), so that they depend on
      !> the settings of the run; unallocated: the lowest modes of the mesh
      type(free_modes_t), allocatable :: modes
      !> Whether each contact is closed, [contacts]
      logical, allocatable :: is_closed(:)
      !> Whether the contact is open and the surface of its stop moves with the beam (spring and damper), [contacts]
      logical, allocatable :: is_deformed(:)
      !> Indentation u of each stop, [contacts]
      real(wp), allocatable :: indentation(:)
      !> Force P2 in the Maxwell branch of a three-element stop, [contacts]
      real(wp), allocatable :: branch_force(:)
      !> With the exact method: if the gap never exceeds this value during the flight in progress, the contact is
      !> captured at its end. With Newmark's method: maximum gap of the flight so far. [contacts]
      real(wp), allocatable :: flight_height(:)
      !> Whether the contact may be captured at the end of the flight in progress, because the gap has stayed below the
      !> hop tolerance of the settings, [contacts]
      logical, allocatable :: may_be_captured(:)
      !> Variations of the state, which a run propagates to its end; unallocated: not requested
      type(tangent_t), allocatable :: tangent
   end type section_state_t

   !> Poincare sections of a run.
   type :: run_sections_t
      !> Period of the load, tau
      real(wp) :: period = 0.0_wp
      !> Maximum period of the motion that is detected, in periods of the load
      integer :: max_periods = 1
      !> Maximum difference of two sections that count as equal, as a fraction of the maximum size of a section. The
      !> size (`size_of` of module `section_records`) is the maximum over all displacements
      real(wp) :: tolerance = 0.0_wp
      !> Instants of the sections, tau, [sections]
      real(wp), allocatable :: tau(:)
      !> Number of sections that have been recorded
      integer :: count = 0
      !> Displacement, upwards from the undeformed beam, and velocity of the tip (index 0) and of what is not the beam,
      !> as in `displacement_row` of an interval, [2, 0:others, sections]; unallocated before the first interval
      real(wp), allocatable :: displacement(:, :, :)
      !> Displacement, upwards from the undeformed beam, and velocity of the beam at each contact, with the contacts in
      !> the order of the scene, [2, contacts, sections]
      real(wp), allocatable :: contact(:, :, :)
      !> Displacement and velocity of the free modes (modes with all contacts open), [2, modes, sections]; unallocated:
      !> not requested
      real(wp), allocatable :: modes(:, :, :)
      !> Number of impacts in the period of the load before each section, [sections]
      integer, allocatable :: impacts(:)
      !> Logarithm of the norm of a variation of the state (solution of the linearised equations) at each section,
      !> [sections]; NaN: the variation has vanished; unallocated: not computed
      real(wp), allocatable :: log_norm(:)
      !> Lyapunov exponent: mean slope of `log_norm`, per tau
      real(wp) :: lyapunov_exponent = 0.0_wp
      !> Period of the motion in periods of the load; 0: none was found
      integer :: motion_period = 0
      !> Mean number of impacts in a period of the load
      real(wp) :: impacts_per_period = 0.0_wp
      !> Number, in the scene's order, of the release contact, to which histories refer; 0: there is none
      integer :: release_contact = 0
   end type run_sections_t

end module section_types
