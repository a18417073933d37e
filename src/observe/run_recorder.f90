!> Recording of a run, by either method: energies, samples (values at equal time steps) of histories, and shapes
!> (displacements of the whole beam at given instants). Only requested quantities are recorded.
module run_recorder
   use history_list, only: history_count
   use kinds, only: wp
   use response_types, only: response_t
   implicit none (type, external)
   private
   public :: energy_balance_t, charge_event, sample_t, requested_t, record_sample
   public :: recorder_t, make_recorder, next_sample_time, samples_before, shape_due, record_shape

   !> Energy balance: the energies dissipated and supplied since the start of the run, up to the start of the present
   !> phase or the end of the last step.
   type :: energy_balance_t
      !> Energy dissipated inside the beam
      real(wp) :: dissipated_beam = 0.0_wp
      !> Energy dissipated in the stops
      real(wp) :: dissipated_stop = 0.0_wp
      !> Energy dissipated at impacts
      real(wp) :: dissipated_impact = 0.0_wp
      !> Energy created by impacts that replace the velocity of one node
      real(wp) :: created = 0.0_wp
      !> Work of forces and of the motion of the base
      real(wp) :: work = 0.0_wp
   end type energy_balance_t

   !> Selection of the quantities that are recorded at the samples.
   type :: requested_t
      !> Whether each history of `history_table` is recorded
      logical :: history(history_count) = .false.
      !> Whether energies are recorded
      logical :: energy = .false.
   end type requested_t

   !> Requested quantities of beam and stops at one instant.
   type :: sample_t
      !> Values of the histories of `history_table`
      real(wp) :: history(history_count) = 0.0_wp
      !> Kinetic energy, then strain energy of the beam
      real(wp) :: beam_energy(2) = 0.0_wp
      !> Strain energy of the springs of the stops
      real(wp) :: stop_energy = 0.0_wp
      !> Energy dissipated in beam and stops since the instant of `energy_balance_t`
      real(wp) :: lost(2) = 0.0_wp
      !> Work of loads since that instant
      real(wp) :: work = 0.0_wp
      !> Bending moments, [places]
      real(wp), allocatable :: moment(:)
      !> Displacement and velocity of each recorded point, and Pbar of the contact forces on it, [3, points];
      !> unallocated: there are none
      real(wp), allocatable :: points(:, :)
   end type sample_t

   !> Recorder of a run by the exact method, phase by phase.
   type :: recorder_t
      type(requested_t) :: requested
      type(energy_balance_t) :: energy_balance
      !> Time between samples, tau
      real(wp) :: step = 0.0_wp
      !> Number of the last sample; sample 0 is at tau = 0; -1: no samples are recorded
      integer :: last = -1
      !> Number of the next sample to record
      integer :: next = 0
      !> Instants at which the shape of the beam is recorded, tau
      real(wp), allocatable :: shape_tau(:)
      !> Index of the next of these instants
      integer :: next_shape = 1
      !> Displacements z and velocities v of the free modes at these instants, [modes, instants]
      real(wp), allocatable :: shape_z(:, :), shape_v(:, :)
      !> Displacement and velocity of a massless node at these instants, [2, instants]
      real(wp), allocatable :: shape_node(:, :)
   end type recorder_t

contains

   !> Add the change of energy of an event to the energy balance: a decrease to the energy dissipated at impacts, an
   !> increase to the created energy.
   elemental subroutine charge_event(balance, change)
      type(energy_balance_t), intent(inout) :: balance
      !> Change of energy
      real(wp), intent(in) :: change

      balance%dissipated_impact = balance%dissipated_impact + max(-change, 0.0_wp)
      balance%created = balance%created + max(change, 0.0_wp)
   end subroutine charge_event

   !> Record a sample in the histories.
   pure subroutine record_sample(place, sample, balance, response)
      !> Index in the histories, from 1
      integer, intent(in) :: place
      type(sample_t), intent(in) :: sample
      type(energy_balance_t), intent(in) :: balance
      type(response_t), intent(inout) :: response

      integer :: i

      do i = 1, history_count
         if (allocated(response%history(i)%values)) response%history(i)%values(place) = sample%history(i)
      end do
      if (allocated(sample%moment)) then
         do i = 1, size(sample%moment)
            if (allocated(response%moments(i)%moment)) response%moments(i)%moment(place) = sample%moment(i)
         end do
      end if
      if (allocated(sample%points)) then
         do i = 1, size(response%points)
            associate (record => response%points(i))
               if (allocated(record%displacement)) record%displacement(place) = sample%points(1, i)
               if (allocated(record%velocity)) record%velocity(place) = sample%points(2, i)
               if (allocated(record%force)) record%force(place) = sample%points(3, i)
            end associate
         end do
      end if
      if (.not. allocated(response%energy)) return
      associate (entry => response%energy)
         entry%kinetic(place) = sample%beam_energy(1)
         entry%strain(place) = sample%beam_energy(2)
         entry%stop(place) = sample%stop_energy
         entry%dissipated_beam(place) = balance%dissipated_beam + sample%lost(1)
         entry%dissipated_stop(place) = balance%dissipated_stop + sample%lost(2)
         entry%dissipated_impact(place) = balance%dissipated_impact
         entry%created(place) = balance%created
         if (allocated(entry%work)) entry%work(place) = balance%work + sample%work
      end associate
   end subroutine record_sample

   !> Prepare the recording of a run by the exact method.
   pure subroutine make_recorder(samples, step, modes, response, recorder)
      !> Number of samples after that at tau = 0
      integer, intent(in) :: samples
      !> Time between samples, tau
      real(wp), intent(in) :: step
      !> Number of modes
      integer, intent(in) :: modes
      !> The run; requested histories are allocated
      type(response_t), intent(in) :: response
      type(recorder_t), intent(out) :: recorder

      integer :: i

      recorder%requested%history = [(allocated(response%history(i)%values), i=1, history_count)]
      recorder%requested%energy = allocated(response%energy)
      recorder%step = step
      if (allocated(response%tau)) recorder%last = samples
      if (.not. allocated(response%shape_tau)) return
      allocate (recorder%shape_tau, source=response%shape_tau)
      associate (instants => size(response%shape_tau))
         allocate (recorder%shape_z(modes, instants), recorder%shape_v(modes, instants))
         allocate (recorder%shape_node(2, instants))
      end associate
   end subroutine make_recorder

   !> Instant of the next sample; `huge` if all samples are recorded.
   pure real(wp) function next_sample_time(recorder) result(time)
      type(recorder_t), intent(in) :: recorder

      time = huge(1.0_wp)
      if (recorder%next <= recorder%last) time = real(recorder%next, wp)*recorder%step
   end function next_sample_time

   !> Whether the next sample is before the end of a phase, or at its end if the run ends with the phase.
   pure logical function samples_before(recorder, to, to_the_end) result(due)
      type(recorder_t), intent(in) :: recorder
      !> End of the phase
      real(wp), intent(in) :: to
      !> Whether the run ends with the phase
      logical, intent(in) :: to_the_end

      due = next_sample_time(recorder) < to
      if (to_the_end) due = recorder%next <= recorder%last
   end function samples_before

   !> Whether the next shape is before the end of a phase, or at its end if the run ends with the phase.
   pure logical function shape_due(recorder, to, to_the_end) result(due)
      type(recorder_t), intent(in) :: recorder
      !> End of the phase
      real(wp), intent(in) :: to
      !> Whether the run ends with the phase
      logical, intent(in) :: to_the_end

      due = .false.
      if (.not. allocated(recorder%shape_tau)) return
      if (recorder%next_shape > size(recorder%shape_tau)) return
      due = to_the_end .or. recorder%shape_tau(recorder%next_shape) < to
   end function shape_due

   !> Record the state at the instant of the next shape.
   pure subroutine record_shape(recorder, q, v, node)
      type(recorder_t), intent(inout) :: recorder
      !> Displacements and velocities of the free modes, [modes]
      real(wp), intent(in) :: q(:)
      real(wp), intent(in) :: v(:)
      !> Displacement and velocity of a massless node
      real(wp), intent(in) :: node(2)

      recorder%shape_node(:, recorder%next_shape) = node
      recorder%shape_z(:, recorder%next_shape) = q
      recorder%shape_v(:, recorder%next_shape) = v
      recorder%next_shape = recorder%next_shape + 1
   end subroutine record_shape

end module run_recorder
