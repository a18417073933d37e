!> The records of a run, for either method: allocation of histories (values at equal time steps) of beam, contacts,
!> recorded points and energies, and of shapes (displacements, slopes and their rates along the whole beam at
!> given instants). Other modules record them.
module response_records
   use beam_model, only: recorded_point_t
   use history_list, only: acceleration_stop, eta_stop, force_stop, history_count, velocity_stop
   use kinds, only: wp
   use response_types, only: contact_record_t, response_t
   use run_settings, only: count_samples, end_of_run, is_within, output_settings_t, response_settings_t
   use sorting, only: ascending_order
   use stop_contacts, only: contact_t, observed_height, owner_of_contact
   implicit none (type, external)
   private
   public :: open_records, open_contact_record

contains

   !> Allocate the requested histories and shapes. Points have histories of displacement, velocity and
   !> force if these quantities are requested at the stop.
   pure subroutine open_records(elements, settings, run, response, is_driven, points)
      !> Number of elements of the mesh
      integer, intent(in) :: elements
      !> Requested output
      type(output_settings_t), intent(in) :: settings
      !> The run, with its duration and the time between samples
      type(response_settings_t), intent(in) :: run
      !> The response; receives arrays for histories, [samples with that at the start], and shapes
      type(response_t), intent(inout) :: response
      !> Whether loads act on the beam, so that their work is recorded
      logical, intent(in) :: is_driven
      !> Recorded points of the model
      type(recorded_point_t), intent(in) :: points(:)

      integer :: i, shapes

      associate (n => count_samples(run%duration, run%step) + 1)
         if (any(settings%history) .or. settings%energy) then
            allocate (response%tau, source=[(real(i, wp)*run%step, i=0, n - 1)])
         end if
         do i = 1, history_count
            if (settings%history(i)) allocate (response%history(i)%values(n), source=0.0_wp)
         end do
         call open_point_records(points, settings, n, response)
         if (settings%energy) then
            allocate (response%energy)
            associate (energy => response%energy)
               allocate (energy%kinetic(n), energy%strain(n), energy%stop(n), energy%dissipated_beam(n), &
                  energy%dissipated_stop(n), energy%dissipated_impact(n), energy%created(n), source=0.0_wp)
            end associate
            if (is_driven) allocate (response%energy%work(n), source=0.0_wp)
         end if
         call find_instants(settings, end_of_run(run), response%shape_tau)
         if (.not. allocated(response%shape_tau)) return
         shapes = size(response%shape_tau)
         allocate (response%shape_displacement(0:elements, shapes), response%shape_slope(0:elements, shapes), &
            response%shape_velocity(0:elements, shapes), response%shape_slope_velocity(0:elements, shapes), &
            source=0.0_wp)
      end associate
   end subroutine open_records

   !> Set position and rest in the records of points, and allocate their histories.
   pure subroutine open_point_records(points, settings, length, response)
      type(recorded_point_t), intent(in) :: points(:)
      type(output_settings_t), intent(in) :: settings
      !> Number of samples, including that at the start
      integer, intent(in) :: length
      type(response_t), intent(inout) :: response

      integer :: i

      if (size(points) == 0) return
      allocate (response%points(size(points)))
      response%points%position = points%position
      response%points%rest = points%rest
      do i = 1, size(points)
         associate (record => response%points(i))
            if (settings%history(eta_stop)) allocate (record%displacement(length), source=0.0_wp)
            if (settings%history(velocity_stop)) allocate (record%velocity(length), source=0.0_wp)
            if (settings%history(force_stop)) allocate (record%force(length), source=0.0_wp)
         end associate
      end do
   end subroutine open_point_records

   !> Instants of the recorded shapes, in ascending order without duplicates: those listed in the settings and equally
   !> spaced ones.
   pure subroutine find_instants(settings, end, instants)
      !> Requested output
      type(output_settings_t), intent(in) :: settings
      !> End of the run, tau
      real(wp), intent(in) :: end
      !> Instants, tau; unallocated: no shapes are requested
      real(wp), allocatable, intent(out) :: instants(:)

      integer :: i, last
      real(wp), allocatable :: listed(:), times(:)

      if (.not. allocated(settings%shape_times) .and. settings%shape_step <= 0.0_wp) return
      allocate (listed(0))
      if (allocated(settings%shape_times)) listed = settings%shape_times(ascending_order(settings%shape_times))
      last = -1
      if (settings%shape_step > 0.0_wp) last = count_samples(end, settings%shape_step)
      times = merged(listed, [(real(i, wp)*settings%shape_step, i=0, last)])
      ! an instant that is beyond the end by rounding is that end
      where (times > end .and. is_within(times, end)) times = end
      instants = pack(times, times >= 0.0_wp .and. times <= end .and. &
         [.true., (times(i) > times(i - 1), i=2, size(times))])
   end subroutine find_instants

   !> Merge two ascending lists.
   pure function merged(first, second) result(values)
      !> The lists, ascending
      real(wp), intent(in) :: first(:)
      real(wp), intent(in) :: second(:)
      real(wp), allocatable :: values(:)

      integer :: i, k
      logical :: takes_first

      allocate (values(size(first) + size(second)))
      i = 0
      do k = 1, size(values)
         takes_first = k - i > size(second)
         if (i < size(first) .and. .not. takes_first) takes_first = first(i + 1) <= second(k - i)
         if (takes_first) then
            i = i + 1
            values(k) = first(i)
         else
            values(k) = second(k - i)
         end if
      end do
   end function merged

   !> Set owner, side, position and height in the record of a contact, and allocate its histories.
   pure subroutine open_contact_record(contact, output, length, record)
      type(contact_t), intent(in) :: contact
      type(output_settings_t), intent(in) :: output
      !> Number of samples, including that at the start
      integer, intent(in) :: length
      type(contact_record_t), intent(out) :: record

      record%contact_owner_t = owner_of_contact(contact)
      record%position = contact%settings%position
      record%height = contact%sign*observed_height(contact)
      if (output%history(eta_stop)) allocate (record%eta(length), source=0.0_wp)
      if (output%history(velocity_stop)) allocate (record%velocity(length), source=0.0_wp)
      if (output%history(force_stop)) allocate (record%force(length), source=0.0_wp)
      if (output%history(acceleration_stop)) allocate (record%acceleration(length), source=0.0_wp)
      if (output%energy) allocate (record%energy(length), record%dissipated(length), source=0.0_wp)
   end subroutine open_contact_record

end module response_records
