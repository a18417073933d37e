!> A Newmark run under way: the beam and the stop, the present state, and where it stands on the grid of steps.
module newmark_run
   use failures, only: failure_t
   use kinds, only: i8, wp
   use newmark_stepper, only: deepest_level, newmark_state_t, newmark_stepper_t
   use response_types, only: run_measures_t
   use run_recorder, only: ledger_t
   use run_settings, only: stop_settings_t
   use step_measures, only: step_measurer_t
   use yielding_stop, only: yielding_stop_t
   implicit none (type, external)
   private
   public :: run_t, progress_t, phase_free, phase_held, phase_contact, whole_step, nowhere
   public :: instant, gap, gap_rate, level_of, stop_energy

   !> Away from the stop.
   integer, parameter :: phase_free = 1
   !> Model A: the stop point is held on the stop.
   integer, parameter :: phase_held = 2
   !> Model B: the stop yields under the beam.
   integer, parameter :: phase_contact = 3

   !> The undivided step in units of the shortest.
   integer(i8), parameter :: whole_step = 2_i8**deepest_level
   !> No step was taken back that ends ahead of the present state.
   integer(i8), parameter :: nowhere = -1_i8

   !> Where a state stands, and what has gathered until then.
   type :: progress_t
      !> Samples passed, whole steps since the last one, and the part of the present one in shortest steps
      integer :: sample = 0
      integer :: part = 0
      integer(i8) :: offset = 0_i8
      !> The next shape to keep
      integer :: next_shape = 1
      type(ledger_t) :: ledger
      type(step_measurer_t) :: measurer
   end type progress_t

   !> One run under way.
   type :: run_t
      type(newmark_stepper_t) :: stepper
      type(stop_settings_t) :: settings
      !> Unallocated: it does not yield
      class(yielding_stop_t), allocatable :: stop
      !> Steps between two samples, and the distance of the samples
      integer :: parts = 1
      real(wp) :: sample_step = 0.0_wp
      !> |eta_c| within which an approach is a contact; f below which, at a sign change, the beam leaves
      real(wp) :: contact_tolerance = 0.0_wp
      real(wp) :: release_force = 0.0_wp
      !> A flight that begins with a rebound and never rises above this is captured
      real(wp) :: hop_height = 0.0_wp
      integer :: event_limit = 0
      !> hbar/L
      real(wp) :: height_ratio = 0.0_wp
      logical :: keeps_ledger = .false.
      !> Measures are asked for; those that are lists
      logical :: keeps_measures = .false.
      type(run_measures_t) :: measures
      logical :: keeps_shapes = .false.
      !> Displacement and rotation of the root among the degrees of freedom; 0: held
      integer :: root_dofs(2) = 0
      !> The present state and, in the other place, the one a step leads to or came from
      type(newmark_state_t) :: states(2)
      integer :: now = 1
      type(progress_t) :: progress
      integer :: phase = phase_free
      !> Model B: what the beam gave the stop over the last step tried
      real(wp) :: stop_work = 0.0_wp
      !> End of the last step taken back, as an offset, as long as it is ahead
      integer(i8) :: refused_end = nowhere
      !> The flight: does it end in capture if it stays low, how high did it rise, may it touch the stop? After leaving
      !> with a rest of force the beam first sinks a little: that is no impact.
      logical :: judged = .false.
      real(wp) :: peak = 0.0_wp
      logical :: armed = .true.
      !> Below the surface, but on the way out: after leaving with a rest of force the springs of model B came back
      !> beyond the beam; or rounding left it there
      logical :: leaving = .false.
      !> Where the flight began
      type(newmark_state_t) :: flight_state
      type(progress_t) :: flight_progress
      !> How often the first step after an impulse is halved (negative: not known yet), that after contact begins with
      !> model B, and the next step at least
      integer :: impulse_level = -1
      integer :: contact_level = 0
      integer :: next_level = 0
      !> Model B: gap at which contact began; the surface is taken to be there
      real(wp) :: contact_gap = 0.0_wp
      !> Set where the run cannot go on: an event cannot be located, or there are too many
      type(failure_t), allocatable :: error
   end type run_t

contains

   !> Instant of a state.
   pure function instant(run, progress) result(tau)
      type(run_t), intent(in) :: run
      !> Where the state stands
      type(progress_t), intent(in) :: progress
      real(wp) :: tau

      tau = (real(progress%sample, wp) + (real(progress%part, wp) + scale(real(progress%offset, wp), -deepest_level)) &
         /real(run%parts, wp))*run%sample_step
   end function instant

   !> Distance of the stop point from the surface.
   pure function gap(run, state) result(distance)
      type(run_t), intent(in) :: run
      type(newmark_state_t), intent(in) :: state
      real(wp) :: distance

      distance = state%displacement(run%stepper%stop_dof) - run%settings%preload + state%indentation
   end function gap

   !> Rate of this distance while the beam is free.
   pure function gap_rate(run, state) result(rate)
      type(run_t), intent(in) :: run
      type(newmark_state_t), intent(in) :: state
      real(wp) :: rate

      rate = state%velocity(run%stepper%stop_dof)
      if (state%indentation > 0.0_wp) rate = rate - run%stop%surface_rate*state%indentation
   end function gap_rate

   !> Energy in the springs of the stop.
   pure function stop_energy(run, state) result(energy)
      type(run_t), intent(in) :: run
      type(newmark_state_t), intent(in) :: state
      real(wp) :: energy

      energy = 0.0_wp
      if (allocated(run%stop)) energy = run%stop%energy(state%indentation, state%branch_force)
   end function stop_energy

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
