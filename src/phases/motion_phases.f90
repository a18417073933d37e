!> Exact motion as a sequence of phases. During a phase the set of closed contacts is constant, and the linear equations
!> of motion are solved in closed form, without time steps. A phase ends at the end of a load segment (a time span in
!> which each load is the sum of a constant, a linear function of time and harmonics), or at the first zero of a gap or
!> of a contact force.
module motion_phases
   use certified_search, only: found_exhausted, found_none, search_t
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use number_text, only: to_text
   use response_types, only: response_t
   use run_observers, only: observers_t
   use run_progress, only: report_progress
   use run_recorder, only: requested_t, record_sample, record_shape, next_sample_time, recorder_t, sample_t, &
      samples_before, shape_due
   use run_settings, only: response_settings_t
   use tangent_columns, only: tangent_t
   implicit none (type, external)
   private
   public :: motion_t, phase_t, advance, found_cancelled, found_segment_end

   ! `found_exhausted` is the last outcome of a search; the following two are further outcomes of a phase.
   !> Outcome: the phase is a flight (motion above an open contact) below the hop tolerance. The flight is cancelled:
   !> the phase has length zero, and the motion stays at its start.
   integer, parameter :: found_cancelled = found_exhausted + 1
   !> Outcome: the phase ends with a load segment.
   integer, parameter :: found_segment_end = found_exhausted + 2

   !> State of the motion between two phases, with the records and measures up to that instant.
   type :: motion_t
      !> Instant, omega1 t
      real(wp) :: tau = 0.0_wp
      !> Displacements of the free modes, [modes]
      real(wp), allocatable :: q(:)
      !> Velocities of the free modes, [modes]
      real(wp), allocatable :: v(:)
      !> What is recorded, the number of the next sample, the recorded shapes, and the energy balance
      type(recorder_t) :: recorder
      !> Observers of the run
      type(observers_t) :: observers
      !> Number of eigenvalue problems solved so far: one for each set of closed contacts that the run uses for the
      !> first time
      integer :: eigenproblems = 0
      !> Variations of the motion (derivatives with respect to its initial state or a load parameter); unallocated: not
      !> requested
      type(tangent_t), allocatable :: tangent
      !> Set if the run cannot continue
      type(failure_t), allocatable :: error
   end type motion_t

   !> A phase of the motion: the part between two changes of the set of closed contacts or of the loads.
   type, abstract :: phase_t
      !> Instant and outcome of the end of the phase. Outcomes: those of a search (`found_none`: the phase reaches the
      !> end of the run), and `found_cancelled` and `found_segment_end`
      type(search_t) :: search
   contains
      procedure(begin_interface), deferred :: begin
      procedure(find_end_interface), deferred :: find_end
      procedure(state_interface), deferred :: evaluate_free_modes
      procedure(sample_interface), deferred :: take_sample
      procedure(finish_interface), deferred :: finish
      procedure(measure_interface), deferred :: measure
      procedure(transition_interface), deferred :: make_transition
   end type phase_t

   abstract interface
      !> Start a phase from the state of the motion.
      subroutine begin_interface(self, motion)
         import :: motion_t, phase_t
         implicit none (type, external)
         class(phase_t), target, intent(inout) :: self
         type(motion_t), intent(inout) :: motion
      end subroutine begin_interface

      !> Find the first zero of the signals of the phase; sets `search`.
      subroutine find_end_interface(self, limit)
         import :: phase_t, wp
         implicit none (type, external)
         class(phase_t), intent(inout) :: self
         !> Time from the start of the phase to the end of the run
         real(wp), intent(in) :: limit
      end subroutine find_end_interface

      !> State of the free modes at a time in the phase.
      subroutine state_interface(self, time, q, v, node)
         import :: phase_t, wp
         implicit none (type, external)
         class(phase_t), intent(in) :: self
         !> Time since the start of the phase
         real(wp), intent(in) :: time
         !> Modal displacements, [modes]
         real(wp), intent(out) :: q(:)
         !> Modal velocities, [modes]
         real(wp), intent(out) :: v(:)
         !> Displacement and velocity of a massless node at the stop, in addition to those that the modes give the node;
         !> 0 if no node is massless
         real(wp), optional, intent(out) :: node(2)
      end subroutine state_interface

      !> Compute the next sample; samples are requested in order, at equal steps.
      subroutine sample_interface(self, time, step, requested, sample)
         import :: requested_t, phase_t, sample_t, wp
         implicit none (type, external)
         class(phase_t), intent(inout) :: self
         !> Time since the start of the phase
         real(wp), intent(in) :: time
         !> Sampling interval
         real(wp), intent(in) :: step
         type(requested_t), intent(in) :: requested
         !> The sample. On entry its values are those of the previous sample (zero at the first sample of a phase), so
         !> quantities that are always zero need not be set
         type(sample_t), intent(inout) :: sample
      end subroutine sample_interface

      !> Advance displacements, velocities and energy balance (not `tau`) to the end of the phase. The last phase of a
      !> run needs no `finish`, because no further phase uses the state.
      subroutine finish_interface(self, motion)
         import :: motion_t, phase_t
         implicit none (type, external)
         class(phase_t), intent(inout) :: self
         !> `tau` is the start of the phase
         type(motion_t), intent(inout) :: motion
      end subroutine finish_interface

      !> Let the observers measure the phase. Because the last phase has no `finish`, this procedure then itself
      !> computes the state, the variations and the energies at the end of the phase that the observers read.
      subroutine measure_interface(self, is_last, motion)
         import :: motion_t, phase_t
         implicit none (type, external)
         class(phase_t), target, intent(inout) :: self
         !> Whether the run ends with this phase, so that `finish` was not called
         logical, intent(in) :: is_last
         !> `tau` is the start of the phase
         type(motion_t), intent(inout) :: motion
      end subroutine measure_interface

      !> Apply the transition at the end of the phase.
      subroutine transition_interface(self, motion, response)
         import :: motion_t, phase_t, response_t
         implicit none (type, external)
         class(phase_t), intent(inout) :: self
         type(motion_t), intent(inout) :: motion
         !> Receives the events
         type(response_t), intent(inout) :: response
      end subroutine transition_interface
   end interface

contains

   !> Advance the motion by one phase and the transition at its end.
   subroutine advance(phase, settings, standstill, motion, response, is_last)
      class(phase_t), target, intent(inout) :: phase
      !> Length of the run, maximum number of events
      type(response_settings_t), intent(in) :: settings
      !> Number of consecutive phases that did not change tau, because their length is zero or below its rounding error
      integer, intent(inout) :: standstill
      !> Component `error` is set if the run cannot continue
      type(motion_t), intent(inout) :: motion
      type(response_t), intent(inout) :: response
      !> Whether the run ends with this phase
      logical, intent(out) :: is_last

      is_last = .false.
      call phase%begin(motion)
      if (allocated(motion%error)) return
      call phase%find_end(settings%duration - motion%tau)
      response%evaluations = response%evaluations + phase%search%evaluations
      standstill = standstill + 1
      if (phase%search%outcome /= found_cancelled) then
         is_last = phase%search%outcome == found_none
         if (is_last) phase%search%time = settings%duration - motion%tau
         call record_phase(phase, is_last, motion, response)
         if (.not. is_last) call phase%finish(motion)
         call phase%measure(is_last, motion)
         if (is_last) return
         if (motion%tau + phase%search%time > motion%tau) standstill = 0
         motion%tau = motion%tau + phase%search%time
      end if
      call report_progress(motion%tau, settings%duration)
      call phase%make_transition(motion, response)
      call check_events(response%event_count, settings%event_limit, standstill, motion%tau, motion%error)
   end subroutine advance

   !> Report an error if there are too many events, or events without progress in time.
   subroutine check_events(events, limit, standstill, tau, error)
      !> Number of events so far
      integer, intent(in) :: events
      !> Maximum number of events
      integer, intent(in) :: limit
      !> Number of consecutive phases that did not change tau
      integer, intent(in) :: standstill
      real(wp), intent(in) :: tau
      !> Set if the run cannot continue
      type(failure_t), allocatable, intent(inout) :: error

      ! maximum number of consecutive phases that do not change tau; far above the number of contacts, each of which may
      ! close, open or be captured at one instant
      integer, parameter :: standstill_cap = 2000
      ! without damping, a contact may open and close with the period of the fastest mode, that of the shortest element
      character(*), parameter :: remedy = '; damping or a more even mesh ends that'

      if (events > limit) then
         call fail(error, status_run_failed, 'more than event_limit = '//to_text(limit)//' events by tau = '// &
            to_text(tau)//': the motion chatters'//remedy)
      else if (standstill > standstill_cap) then
         call fail(error, status_run_failed, 'the motion does not advance beyond tau = '//to_text(tau)// &
            ': events follow each other within the rounding error of time'//remedy)
      end if
   end subroutine check_events

   !> Record the samples of a phase, and the shapes of the whole beam that are due in the phase.
   subroutine record_phase(phase, is_last, motion, response)
      class(phase_t), intent(inout) :: phase
      !> Whether the run ends with this phase
      logical, intent(in) :: is_last
      type(motion_t), intent(inout) :: motion
      !> Receives the histories
      type(response_t), intent(inout) :: response

      type(sample_t) :: sample
      real(wp), allocatable :: q(:), v(:)
      real(wp) :: node(2), end_tau

      associate (recorder => motion%recorder)
         end_tau = motion%tau + phase%search%time
         do while (shape_due(recorder, end_tau, is_last))
            if (.not. allocated(q)) allocate (q(size(motion%q)), v(size(motion%v)))
            call phase%evaluate_free_modes(recorder%shape_tau(recorder%next_shape) - motion%tau, q, v, node)
            call record_shape(recorder, q, v, node)
         end do
         do while (samples_before(recorder, end_tau, is_last))
            ! a sample at the start of the phase may precede it by a rounding error
            call phase%take_sample(max(next_sample_time(recorder) - motion%tau, 0.0_wp), recorder%step, &
               recorder%requested, sample)
            ! sample 0, the initial state, has the index 1
            recorder%next = recorder%next + 1
            call record_sample(recorder%next, sample, recorder%energy_balance, response)
         end do
      end associate
   end subroutine record_phase

end module motion_phases
