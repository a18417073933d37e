!> Histories at equal steps from motion in closed form: inside a phase the modal states advance by constant
!> 2 x 2 matrices, renewed from the closed form so often that rounding does not grow.
module modal_recorder
   use damped_oscillators, only: apply_step, oscillators_t, propagate, step_matrices, step_matrices_t
   use kinds, only: wp
   use modal_beam, only: modal_beam_t
   use response_types, only: response_t
   implicit none (type, external)
   private
   public :: recorder_t, make_recorder, steps_t, next_sample_time, record_sample, samples_before
   public :: phase_sampler_t, start_sampler, next_sample, record_free_motion

   !> Samples after which the recurrence starts anew from the closed form.
   integer, parameter :: renewal = 64

   !> What has been recorded so far.
   type :: recorder_t
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
   pure subroutine make_recorder(samples, step, recorder)
      !> Samples after the one at tau = 0
      integer, intent(in) :: samples
      !> Their distance, tau
      real(wp), intent(in) :: step
      !> The recorder
      type(recorder_t), intent(out) :: recorder

      recorder%step = step
      recorder%last = samples
   end subroutine make_recorder

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

   !> Samples of a free flight.
   pure subroutine record_free_motion(beam, surface, from, to, to_the_end, q, v, steps, recorder, response)
      !> The beam in its free modes
      type(modal_beam_t), intent(in) :: beam
      !> delta
      real(wp), intent(in) :: surface
      !> Start and end of the flight
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
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
      integer :: place

      if (.not. samples_before(recorder, to, to_the_end)) return
      call start_sampler(from, q, v, sampler)
      do while (samples_before(recorder, to, to_the_end))
         call next_sample(sampler, beam%oscillators, steps, recorder%step, next_sample_time(recorder))
         call record_sample(recorder, place)
         if (allocated(response%displacement_stop)) &
            response%displacement_stop(place) = sum(beam%stop_value*sampler%z) - surface
         if (allocated(response%displacement_tip)) &
            response%displacement_tip(place) = sum(beam%tip_value*sampler%z) - surface
         if (allocated(response%velocity_stop)) response%velocity_stop(place) = sum(beam%stop_value*sampler%v)
         if (allocated(response%contact_force)) response%contact_force(place) = 0.0_wp
      end do
   end subroutine record_free_motion

end module modal_recorder
