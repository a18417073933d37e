!> State of a motion at an instant, and its Poincare sections: states at intervals of one period of the load
!> (docs/theory.md, section 21).
module section_types
   use kinds, only: wp
   use tangent_columns, only: tangent_t
   implicit none (type, external)
   private
   public :: section_state_t, run_sections_t

   !> Complete state of a motion, from which another run can continue. Contacts are in the order of `contacts_of`.
   type :: section_state_t
      !> Instant of the state
      real(wp) :: tau = 0.0_wp
      !> Displacements and velocities of the free modes (newmark: of the degrees of freedom, padded with three zeros at
      !> both ends, [-2 : order + 3]); unallocated: there is no state
      real(wp), allocatable :: q(:), v(:)
      !> Number of lowest modes of the beam among the modes of `q`, whose other modes are residual modes (static shapes
      !> that replace the omitted modes); 0: `q` contains all modes of the mesh
      integer :: lowest_modes = 0
      !> Whether each contact is closed; whether it is open while its stop is still deformed
      logical, allocatable :: is_closed(:), is_deformed(:)
      !> Indentation u of the stop, and force in its branch
      real(wp), allocatable :: indentation(:), branch_force(:)
      !> exact: the flight in progress counts as a capture if its gap never exceeds this value. newmark: maximum gap of
      !> the flight so far
      real(wp), allocatable :: hop_tolerance(:)
      !> Whether the flight in progress has stayed below the hop tolerance, so that it may count as a capture
      logical, allocatable :: is_low(:)
      !> Variations of the state, which a run propagates to its end; unallocated: not requested
      type(tangent_t), allocatable :: tangent
   end type section_state_t

   !> Poincare sections of a run.
   type :: run_sections_t
      !> Period of the load, tau
      real(wp) :: period = 0.0_wp
      !> Maximum period of the motion that is detected, in periods of the load
      integer :: max_periods = 1
      !> Maximum difference of two sections that count as equal, as a fraction of the maximum of all sections
      real(wp) :: tolerance = 0.0_wp
      !> Instants, [sections]; the first `count` have been recorded
      real(wp), allocatable :: tau(:)
      integer :: count = 0
      !> Displacement, upwards from the undeformed beam, and velocity: of the tip, [2, sections], and at each contact in
      !> the scene's order, [2, contacts, sections]
      real(wp), allocatable :: tip(:, :), stop(:, :, :)
      !> Displacement and velocity of each body, [2, bodies, sections]
      real(wp), allocatable :: body(:, :, :)
      !> Displacement and velocity of the free modes, [2, modes, sections]; unallocated: not requested
      real(wp), allocatable :: modes(:, :, :)
      !> Number of impacts in the period of the load before each section, [sections]
      integer, allocatable :: impacts(:)
      !> Logarithm of the norm of a variation of the state (solution of the linearised equations) at each section, NaN
      !> if it has vanished; unallocated: not computed
      real(wp), allocatable :: log_size(:)
      !> Lyapunov exponent: growth rate of that logarithm, per tau
      real(wp) :: lyapunov_exponent = 0.0_wp
      !> Period of the motion in periods of the load; 0: none was found
      integer :: motion_period = 0
      !> Mean number of impacts in a period of the load
      real(wp) :: impacts_per_period = 0.0_wp
      !> Number, in the scene's order, of the contact from which the beam is released; 0: there is none
      integer :: release_contact = 0
   end type run_sections_t

end module section_types
