!> Histories at equal steps from motion in closed form: inside a phase the modal states advance by constant
!> 2 x 2 matrices, renewed from the closed form so often that rounding does not grow.
module modal_recorder
   use damped_oscillators, only: apply_step, oscillators_t, propagate, step_matrices, step_matrices_t
   use flight_measures, only: measurer_t
   use history_list, only: eta_stop, eta_tip, force_stop, velocity_stop
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use response_types, only: response_t
   implicit none (type, external)
   private
   public :: recorder_t, make_recorder, steps_t, next_sample_time, record_sample, samples_before
   public :: phase_sampler_t, start_sampler, next_sample, record_free_motion
   public :: ledger_t, keep_energy, shape_due, keep_shape, charge_event, modal_energy

   !> Samples after which the recurrence starts anew from the closed form.
   integer, parameter :: renewal = 64

   !> Energies lost and won up to the start of the present phase.
   type :: ledger_t
      real(wp) :: dissipated_beam = 0.0_wp
      real(wp) :: dissipated_stop = 0.0_wp
      real(wp) :: dissipated_impact = 0.0_wp
      !> By the nodal reading of the impulse
      real(wp) :: created = 0.0_wp
   end type ledger_t

   !> What has been recorded so far.
   type :: recorder_t
      type(ledger_t) :: ledger
      !> Measures from the phases
      type(measurer_t) :: measurer
      !> Instants at which the whole beam is kept, the next of them, and its modal states there, [modes, instants]
      real(wp), allocatable :: shape_tau(:)
      integer :: next_shape = 1
      real(wp), allocatable :: shape_z(:, :), shape_v(:, :)
      !> d tau between samples
      real(wp) :: step = 0.0_wp
      !> Samples in all, sample 0 at tau = 0
      integer :: last = 0
      !> The next sample to record
      integer :: next = 0
   end type recorder_t

   !> Step matrices of one family of oscillators, made at their first use.
   type :: steps_t
      logical :: made = .false.
      type(step_matrices_t) :: matrices
   end type steps_t

   !> Runs through the samples of one phase.
   type :: phase_sampler_t
      !> State at the start of the phase
      real(wp), allocatable :: z0(:), v0(:)
      !> State at the sample
      real(wp), allocatable :: z(:), v(:)
      !> Start of the phase
      real(wp) :: start = 0.0_wp
      !> Samples since the last renewal
      integer :: since = 0
   end type phase_sampler_t

contains

   !> Prepare the recording of a run.
   pure subroutine make_recorder(samples, step, modes, response, recorder)
      !> Samples after the one at tau = 0
      integer, intent(in) :: samples
      !> Their distance, tau
      real(wp), intent(in) :: step
      !> Number of modes
      integer, intent(in) :: modes
      !> What is asked for: its `tau` and `shape_tau`
      type(response_t), intent(in) :: response
      !> The recorder
      type(recorder_t), intent(out) :: recorder

      recorder%step = step
      recorder%last = samples
      if (.not. allocated(response%tau)) recorder%last = -1
      if (.not. allocated(response%shape_tau)) return
      allocate (recorder%shape_tau, source=response%shape_tau)
      allocate (recorder%shape_z(modes, size(response%shape_tau)), recorder%shape_v(modes, size(response%shape_tau)))
   end subroutine make_recorder

   !> Is the whole beam to be kept at an instant of this phase?
   pure function shape_due(recorder, to, to_the_end) result(due)
      !> The recorder
      type(recorder_t), intent(in) :: recorder
      !> End of the phase
      real(wp), intent(in) :: to
      !> The run ends with it
      logical, intent(in) :: to_the_end
      logical :: due

      due = .false.
      if (.not. allocated(recorder%shape_tau)) return
      if (recorder%next_shape > size(recorder%shape_tau)) return
      due = to_the_end .or. recorder%shape_tau(recorder%next_shape) < to
   end function shape_due

   !> Keep the modal state at the next of these instants.
   pure subroutine keep_shape(recorder, q, v)
      !> The recorder
      type(recorder_t), intent(inout) :: recorder
      !> State in the free modes
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)

      recorder%shape_z(:, recorder%next_shape) = q
      recorder%shape_v(:, recorder%next_shape) = v
      recorder%next_shape = recorder%next_shape + 1
   end subroutine keep_shape

   !> Kinetic and strain energy of modes.
   pure function modal_energy(oscillators, z, v) result(energy)
      !> The modes
      type(oscillators_t), intent(in) :: oscillators
      !> Their state
      real(wp), intent(in) :: z(:)
      real(wp), intent(in) :: v(:)
      !> Kinetic, strain
      real(wp) :: energy(2)

      energy = 0.5_wp*[sum(v**2), sum(oscillators%square*z**2)]
   end function modal_energy

   !> Enter a sample into the ledger.
   pure subroutine keep_energy(response, place, ledger, energy, stop, beam_loss, stop_loss)
      !> Gets the entry
      type(response_t), intent(inout) :: response
      !> Place of the sample
      integer, intent(in) :: place
      !> Up to the start of the phase
      type(ledger_t), intent(in) :: ledger
      !> Kinetic and strain energy
      real(wp), intent(in) :: energy(2)
      !> Energy in the springs of the stop
      real(wp), intent(in) :: stop
      !> Dissipated since the start of the phase, in the beam and in the stop
      real(wp), intent(in) :: beam_loss
      real(wp), intent(in) :: stop_loss

      associate (entry => response%energy)
         entry%kinetic(place) = energy(1)
         entry%strain(place) = energy(2)
         entry%stop(place) = stop
         entry%dissipated_beam(place) = ledger%dissipated_beam + beam_loss
         entry%dissipated_stop(place) = ledger%dissipated_stop + stop_loss
         entry%dissipated_impact(place) = ledger%dissipated_impact
         entry%created(place) = ledger%created
      end associate
   end subroutine keep_energy

   !> Charge an event's change of energy to impacts, or to the nodal reading where it created some.
   elemental subroutine charge_event(ledger, change)
      !> The ledger
      type(ledger_t), intent(inout) :: ledger
      !> Change of energy
      real(wp), intent(in) :: change

      ledger%dissipated_impact = ledger%dissipated_impact + max(-change, 0.0_wp)
      ledger%created = ledger%created + max(change, 0.0_wp)
   end subroutine charge_event

   !> Instant of the next sample; huge when all are recorded.
   pure function next_sample_time(recorder) result(time)
      !> The recorder
      type(recorder_t), intent(in) :: recorder
      real(wp) :: time

      time = huge(1.0_wp)
      if (recorder%next <= recorder%last) time = real(recorder%next, wp)*recorder%step
   end function next_sample_time

   !> Is the next sample due before (or, at the end of the run, at) an instant?
   pure function samples_before(recorder, time, inclusive) result(due)
      !> The recorder
      type(recorder_t), intent(in) :: recorder
      !> The instant
      real(wp), intent(in) :: time
      !> A sample at the instant counts
      logical, intent(in) :: inclusive
      logical :: due

      due = next_sample_time(recorder) < time
      if (inclusive) due = recorder%next <= recorder%last
   end function samples_before

   !> Count a sample as recorded; returns its place in the histories.
   pure subroutine record_sample(recorder, place)
      !> The recorder
      type(recorder_t), intent(inout) :: recorder
      !> Place in the histories, from 1
      integer, intent(out) :: place

      place = recorder%next + 1
      recorder%next = recorder%next + 1
   end subroutine record_sample

   !> Begin a phase.
   pure subroutine start_sampler(start, z0, v0, sampler)
      !> Instant of its start
      real(wp), intent(in) :: start
      !> State there
      real(wp), intent(in) :: z0(:)
      real(wp), intent(in) :: v0(:)
      !> The sampler
      type(phase_sampler_t), intent(out) :: sampler

      allocate (sampler%z0, source=z0)
      allocate (sampler%v0, source=v0)
      allocate (sampler%z(size(z0)), sampler%v(size(z0)))
      sampler%start = start
      sampler%since = renewal
   end subroutine start_sampler

   !> Go to a sample: by one step from the one before, or from the closed form when that is due.
   pure subroutine next_sample(sampler, oscillators, steps, step, time)
      !> The sampler
      type(phase_sampler_t), intent(inout) :: sampler
      !> Oscillators of the phase
      type(oscillators_t), intent(in) :: oscillators
      !> Their step matrices
      type(steps_t), intent(inout) :: steps
      !> Distance of samples
      real(wp), intent(in) :: step
      !> Instant of the sample
      real(wp), intent(in) :: time

      if (sampler%since >= renewal) then
         call propagate(oscillators, max(time - sampler%start, 0.0_wp), sampler%z0, sampler%v0, sampler%z, sampler%v)
         sampler%since = 0
      else
         if (.not. steps%made) then
            call step_matrices(oscillators, step, steps%matrices)
            steps%made = .true.
         end if
         call apply_step(steps%matrices, sampler%z, sampler%v)
         sampler%since = sampler%since + 1
      end if
   end subroutine next_sample

   !> Samples of a free flight; above a surface that relaxes where the stop is model B.
   pure subroutine record_free_motion(beam, surface, stop_energy, stop_decay, from, length, to_the_end, q, v, steps, &
                                      recorder, response)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> delta
      real(wp), intent(in) :: surface
      !> Energy in the stop at the start, and the rate at which the relaxing surface dissipates it
      real(wp), intent(in) :: stop_energy
      real(wp), intent(in) :: stop_decay
      !> Start and length of the flight; the length has digits that the difference of two instants has lost
      real(wp), intent(in) :: from
      real(wp), intent(in) :: length
      !> The run ends with this flight
      logical, intent(in) :: to_the_end
      !> Modal state at its start
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      !> Step matrices of the free modes
      type(steps_t), intent(inout) :: steps
      !> Samples
      type(recorder_t), intent(inout) :: recorder
      !> Gets the histories
      type(response_t), intent(inout) :: response

      type(phase_sampler_t) :: sampler
      real(wp), dimension(size(q)) :: q_then, v_then
      real(wp) :: start_energy, energy(2), stop, time, to
      integer :: place

      to = from + length
      do while (shape_due(recorder, to, to_the_end))
         call propagate(beam%oscillators, recorder%shape_tau(recorder%next_shape) - from, q, v, q_then, v_then)
         call keep_shape(recorder, q_then, v_then)
      end do
      start_energy = 0.0_wp
      if (allocated(response%energy)) start_energy = sum(modal_energy(beam%oscillators, q, v))
      if (samples_before(recorder, to, to_the_end)) then
         call start_sampler(from, q, v, sampler)
         do while (samples_before(recorder, to, to_the_end))
            time = next_sample_time(recorder)
            call next_sample(sampler, beam%oscillators, steps, recorder%step, time)
            call record_sample(recorder, place)
            if (allocated(response%history(eta_stop)%values)) &
               response%history(eta_stop)%values(place) = sum(beam%stop_value*sampler%z) - surface
            if (allocated(response%history(eta_tip)%values)) &
               response%history(eta_tip)%values(place) = sum(beam%tip_value*sampler%z) - surface
            if (allocated(response%history(velocity_stop)%values)) &
               response%history(velocity_stop)%values(place) = sum(beam%stop_value*sampler%v)
            if (allocated(response%history(force_stop)%values)) response%history(force_stop)%values(place) = 0.0_wp
            if (allocated(response%energy)) then
               energy = modal_energy(beam%oscillators, sampler%z, sampler%v)
               stop = stop_energy*exp(-stop_decay*max(time - from, 0.0_wp))
               ! what a damped mode loses is what its damping takes: 2 zeta W^2 v^2 integrated
               call keep_energy(response, place, recorder%ledger, energy, stop, start_energy - sum(energy), &
                                stop_energy - stop)
            end if
         end do
      end if
      if (.not. allocated(response%energy) .or. to_the_end) return
      call propagate(beam%oscillators, length, q, v, q_then, v_then)
      associate (ledger => recorder%ledger)
         ledger%dissipated_beam = ledger%dissipated_beam + start_energy &
                                  - sum(modal_energy(beam%oscillators, q_then, v_then))
         ledger%dissipated_stop = ledger%dissipated_stop + stop_energy*(1.0_wp - exp(-stop_decay*length))
      end associate
   end subroutine record_free_motion

end module modal_recorder
