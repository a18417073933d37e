!> A Newmark run with any number of surfaces under way: the beam, the surfaces and how they stand with it, the present
!> state, and where it stands on the grid of steps.
module newmark_run
   use applied_loads, only: applied_loads_t
   use contact_measures, only: measurer_t
   use contact_rows, only: along, contact_row_t
   use failures, only: failure_t
   use kinds, only: i8, wp
   use moment_places, only: moment_places_t
   use newmark_stepper, only: deepest_level, newmark_state_t, newmark_stepper_t
   use run_observers, only: observers_t
   use run_recorder, only: ledger_t
   use skyline_matrix, only: skyline_t
   use statistic_types, only: impact_t
   use step_intervals, only: step_interval_t
   use stop_contacts, only: contact_t
   use yielding_stop, only: rounding_of_force, stop_step_t, yielding_stop_t
   implicit none (type, external)
   private
   public :: newmark_run_t, run_state_t, run_progress_t, contact_progress_t
   public :: whole_step, nowhere, level_of, begins_now, is_open, is_constrained, is_in_contact, is_lifted, is_inactive
   public :: instant_of, gap_at, gap_rate_at, depth_at, lifted_force, lets_go, rounding_at, contact_energy, energy_left

   !> The undivided step in units of the shortest.
   integer(i8), parameter :: whole_step = 2_i8**deepest_level
   !> No step was taken back that ends ahead of the present state.
   integer(i8), parameter :: nowhere = -1_i8

   !> The beam is away from the surface.
   integer, parameter :: is_open = 1
   !> A rigid surface holds the beam.
   integer, parameter :: is_constrained = 2
   !> The surface yields under the beam.
   integer, parameter :: is_in_contact = 3
   !> Spring and damper: indented, but without force, as they would have to pull.
   integer, parameter :: is_lifted = 4
   !> Another rigid surface lies before it.
   integer, parameter :: is_inactive = 5

   !> No numbers of events: the flight begins at this instant; it cannot be taken back.
   integer, parameter :: begins_now = -1
   integer, parameter :: is_interrupted = -2

   !> The beam, and of each surface the force P, the indentation u and the branch force.
   type :: run_state_t
      type(newmark_state_t) :: beam
      real(wp), allocatable :: force(:)
      real(wp), allocatable :: indentation(:)
      real(wp), allocatable :: branch_force(:)
      !> Instant whose loads act on it: where they jump, just before or after
      real(wp) :: load_tau = 0.0_wp
   end type run_state_t

   !> How a surface stands with the beam; numbers only, so that it can be put back where a flight is taken back.
   type :: contact_progress_t
      !> One of the constants above
      integer :: status = is_open
      !> The flight is judged by its height, the highest point of it so far, it may touch, it is on the way out from
      !> beyond the surface: after a separation with a rest of force the springs came back beyond the beam, or rounding
      !> left it there
      logical :: judged = .false.
      real(wp) :: peak = 0.0_wp
      logical :: armed = .true.
      logical :: leaving = .false.
      !> Number of events of the run when the flight began, or one of the constants above
      integer :: flight_events = is_interrupted
      !> Rigid: the impact problem has brought it to rest, and whether that is in the list of events as a capture
      logical :: is_stopped = .false.
      logical :: is_captured = .false.
      !> Captures since the beam was last higher above it than a flight that ends in capture, or thrown off by more than
      !> another capture
      integer :: captures = 0
      !> Gap at which contact began; the surface is taken to be there
      real(wp) :: shift = 0.0_wp
      !> End of the last step taken back on its account, as an offset, as long as it is ahead
      integer(i8) :: refused_end = nowhere
      !> What it has dissipated, at impacts too
      real(wp) :: dissipated = 0.0_wp
      !> How often the beam has left it since the start of the run
      integer :: flights = 0
   end type contact_progress_t

   type, extends(contact_progress_t) :: newmark_contact_t
      type(contact_t) :: contact
      type(contact_row_t) :: row
      !> Unallocated: it is rigid
      class(yielding_stop_t), allocatable :: stop
      !> Spring and damper: the surface does not come back on its own
      logical :: is_viscous = .false.
      !> How often the first step of a contact is halved
      integer :: contact_level = 0
      !> What the beam gave it over the last step tried
      real(wp) :: work = 0.0_wp
   end type newmark_contact_t

   !> What a step of one length needs besides the stepper's factors.
   type :: contact_factors_t
      logical :: made = .false.
      !> A^-1 w of each row, padded, [-2 : order + 3, surfaces]
      real(wp), allocatable :: columns(:, :)
      !> w_j . A^-1 w_l, [surfaces, surfaces]
      real(wp), allocatable :: gains(:, :)
      !> Surfaces that yield, over this step, [surfaces]
      type(stop_step_t), allocatable :: stops(:)
   end type contact_factors_t

   !> Where a run stands on the grid of steps, and what has gathered until then; numbers only.
   type :: run_progress_t
      !> Samples passed, whole steps since the last one, the part of the present one in shortest steps, the next shape
      integer :: sample = 0
      integer :: part = 0
      integer(i8) :: offset = 0_i8
      integer :: next_shape = 1
      !> How often the next step is halved at least
      integer :: next_level = 0
      !> The next instant at which loads jump
      integer :: next_jump = 1
      !> All work of loads so far, won and lost
      real(wp) :: turnover = 0.0_wp
      type(ledger_t) :: ledger
   end type run_progress_t

   !> Where the last flight after a rebound began.
   type :: flight_start_t
      type(run_state_t) :: state
      type(run_progress_t) :: progress
      type(contact_progress_t), allocatable :: contacts(:)
      type(measurer_t), allocatable :: measurers(:)
      !> Least and greatest moments, and when, [4, places]
      real(wp), allocatable :: moments(:, :)
      !> Sections that had come
      integer :: sections = 0
      !> Sums of the block under way, of each surface and of the tip, [sum_count, 0:surfaces], its number, and of each
      !> surface the last impact and whether the beam has been away from it since
      integer :: block = 0
      real(wp), allocatable :: sums(:, :)
      type(impact_t), allocatable :: impacts(:)
      logical, allocatable :: has_flown(:)
   end type flight_start_t

   type, extends(run_progress_t) :: newmark_run_t
      type(newmark_stepper_t) :: stepper
      type(newmark_contact_t), allocatable :: contacts(:)
      !> Place of the surface at which histories are taken, from which a beam is released, and d there; 0: there are no
      !> surfaces
      integer :: release_contact = 1
      real(wp) :: height = 0.0_wp
      !> Made when first needed, [0:deepest_level]
      type(contact_factors_t) :: factors(0:deepest_level)
      !> M*^-1 w of each row, padded, [-2 : order + 3, contacts], and w_j . M*^-1 w_l, [surfaces, surfaces]
      real(wp), allocatable :: mass_columns(:, :)
      real(wp), allocatable :: mobility(:, :)
      !> Steps between two samples, and their distance
      integer :: parts = 1
      real(wp) :: sample_step = 0.0_wp
      !> Samples after the one at the start
      integer :: samples = 0
      !> Gap within which an approach is a contact; force below which, at a sign change, the beam leaves
      real(wp) :: contact_tolerance = 0.0_wp
      real(wp) :: release_force = 0.0_wp
      !> A flight that begins with a rebound and never rises above this is captured
      real(wp) :: hop_height = 0.0_wp
      integer :: event_limit = 0
      real(wp) :: height_ratio = 0.0_wp
      logical :: keeps_ledger = .false.
      logical :: keeps_shapes = .false.
      !> Some observer asks for steps
      logical :: observes = .false.
      type(observers_t) :: observers
      !> The step last taken as observers see it
      type(step_interval_t) :: interval
      !> Displacement and rotation of the root among the degrees of freedom; 0: held
      integer :: root_dofs(2) = 0
      !> The present state and, in the other place, the one a step leads to or came from
      type(run_state_t) :: states(2)
      integer :: now = 1
      !> A flight begins that its height will judge, and where the last such began
      logical :: begins_flight = .false.
      type(flight_start_t) :: flight_start
      !> How often the first step after an impulse is halved; negative: not known yet
      integer :: impulse_level = -1
      !> What acts on the beam, and the instants at which that may jump
      type(applied_loads_t) :: loads
      real(wp), allocatable :: jumps(:)
      !> Bending moments: what makes them of the state; unallocated: none are asked for
      type(moment_places_t), allocatable :: places
      !> What M* has more than M as a share of K, and of the damping that is not in proportion to K
      real(wp) :: share_of_stiffness = 0.0_wp
      real(wp) :: share_of_damping = 0.0_wp
      !> That damping in proportion to the mass; where it is that of each mode instead, its matrix, and the factors of M
      real(wp) :: mass_damping = 0.0_wp
      logical :: damps_modes = .false.
      type(skyline_t) :: mode_damping, bare_mass
      real(wp) :: start_energy = 0.0_wp
      !> Room for the equations of the closed surfaces: which, their matrix, and right side or forces
      integer, allocatable :: closed(:)
      real(wp), allocatable :: rows(:, :)
      real(wp), allocatable :: right(:)
      !> Which surfaces keep a step from standing; have an event ahead, as they kept a longer step from standing; meet
      !> the beam at the end of a step; leave it
      logical, allocatable :: refuses(:)
      logical, allocatable :: closing(:)
      logical, allocatable :: arrives(:)
      logical, allocatable :: leaves(:)
      !> Some surface may be closing, and some yields
      logical :: is_closing = .false.
      logical :: yields = .false.
      !> Set where the run cannot go on
      type(failure_t), allocatable :: error
   end type newmark_run_t

contains

   !> Instant of the present state.
   pure function instant_of(run, further) result(tau)
      type(newmark_run_t), intent(in) :: run
      !> So many shortest steps later
      integer(i8), intent(in), optional :: further
      real(wp) :: tau

      real(wp), parameter :: shortest = 0.5_wp**deepest_level
      integer(i8) :: offset

      offset = run%offset
      if (present(further)) offset = offset + further
      tau = (real(run%sample, wp) + (real(run%part, wp) + shortest*real(offset, wp))/real(run%parts, wp)) &
         *run%sample_step
   end function instant_of

   !> Distance of the stop point from a surface, which may be indented still.
   pure function gap_at(run, k, state) result(gap)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state
      real(wp) :: gap

      associate (contact => run%contacts(k))
         gap = along(contact%row, state%beam%displacement) - contact%contact%height
         if (.not. contact%is_viscous) gap = gap + state%indentation(k)
      end associate
   end function gap_at

   !> Rate of this distance while the surface is open.
   pure function gap_rate_at(run, k, state) result(rate)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state
      real(wp) :: rate

      associate (contact => run%contacts(k))
         rate = along(contact%row, state%beam%velocity)
         if (contact%is_viscous) return
         if (state%indentation(k) > 0.0_wp) rate = rate - contact%stop%surface_rate*state%indentation(k)
      end associate
   end function gap_rate_at

   !> Indentation of a surface that the beam has not left.
   pure function depth_at(run, k, state) result(depth)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state
      real(wp) :: depth

      associate (contact => run%contacts(k))
         depth = contact%contact%height + contact%shift - along(contact%row, state%beam%displacement)
      end associate
   end function depth_at

   !> k u + c u' of spring and damper.
   pure function lifted_force(run, k, state) result(force)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state
      real(wp) :: force

      associate (contact => run%contacts(k))
         force = contact%stop%stiffness*state%indentation(k) &
            - contact%stop%viscosity*along(contact%row, state%beam%velocity)
      end associate
   end function lifted_force

   !> What rounding may leave of the force of a surface that yields.
   pure function rounding_at(run, k, state) result(force)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state
      real(wp) :: force

      associate (contact => run%contacts(k))
         force = rounding_of_force(contact%stop, abs(contact%contact%height) &
            + abs(along(contact%row, state%beam%displacement)), abs(along(contact%row, state%beam%velocity)))
      end associate
   end function rounding_at

   !> Do spring and damper push no more? Up to the force of release they need not; but that knows nothing of the spring,
   !> beside which it may be large: where the beam presses on they push.
   pure function lets_go(run, k, state)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state
      logical :: lets_go

      real(wp) :: force

      force = lifted_force(run, k, state)
      associate (contact => run%contacts(k))
         lets_go = force <= rounding_at(run, k, state) .or. &
            (force <= run%release_force .and. along(contact%row, state%beam%velocity) >= 0.0_wp)
      end associate
   end function lets_go

   !> Energy in the springs of a surface.
   pure function contact_energy(run, k, state) result(energy)
      type(newmark_run_t), intent(in) :: run
      !> The contact
      integer, intent(in) :: k
      type(run_state_t), intent(in) :: state
      real(wp) :: energy

      energy = 0.0_wp
      associate (contact => run%contacts(k))
         if (allocated(contact%stop)) energy = contact%stop%energy(state%indentation(k), state%branch_force(k))
      end associate
   end function contact_energy

   !> Energy of beam and surfaces at the present state: the ledger closes to rounding.
   pure function energy_left(run) result(energy)
      type(newmark_run_t), intent(in) :: run
      real(wp) :: energy

      associate (ledger => run%ledger)
         energy = run%start_energy + ledger%work + ledger%created - ledger%dissipated_beam - ledger%dissipated_stop &
            - ledger%dissipated_impact
      end associate
   end function energy_left

   !> How often the step must be halved to be no longer than this.
   pure function level_of(step, time) result(level)
      !> Length of the undivided step
      real(wp), intent(in) :: step
      !> The time to resolve
      real(wp), intent(in) :: time
      integer :: level

      ! beyond this, what happens at once and what happens in the shortest step differ by less than rounding
      integer, parameter :: deepest_start = 30

      level = 0
      do while (level < deepest_start .and. scale(step, -level) > time)
         level = level + 1
      end do
   end function level_of

end module newmark_run
