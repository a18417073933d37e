!> Fourier integrals of the signals of a run, for the power spectra of its segments (docs/theory.md, section 24). An
!> integral is that of signal times exp(-i omega tau).
!>
!> With Hann windows, successive segments overlap by half. The integrals are therefore taken over half segments, so that
!> no interval of the motion is integrated twice. Because the window is w(u) = (1 - cos(Omega u))/2, the transform of a
!> segment is a sum of integrals at three frequencies: omega, omega - Omega and omega + Omega. With rectangular windows
!> a "half segment" is a whole segment.
!>
!> Intervals are integrated in closed form until this has cost more than a limit; from then on the signals are sampled.
module run_spectra
   use exponential_sums, only: differentiate, exponential_sums_t, open_sums, value_of
   use fourier_integrals, only: add_fourier_integrals, add_impulse
   use kinds, only: pi, wp
   use motion_intervals, only: interval_t, observed_contact_t
   use response_types, only: response_t
   use run_settings, only: end_of_run, run_settings_t
   use sampled_transforms, only: fourier_sums
   use spectrum_settings, only: quantity_force, quantity_moment, signal_table, window_hann
   use spectrum_types, only: run_spectrum_t
   use spectrum_windows, only: open_windows, transforms_of, windows_t
   use stop_contacts, only: contact_t, contacts_of, force_on_point
   implicit none (type, external)
   private
   public :: spectrum_sums_t, open_spectrum, add_interval, take_impulses, finish_spectrum

   !> Number of samples in a period of the highest frequency.
   real(wp), parameter :: samples_per_period = 16.0_wp
   !> Minimum number of samples in a half segment.
   integer, parameter :: min_samples = 64

   !> Accumulated integrals of a run. Instants are tau if their names or comments do not say otherwise.
   type :: spectrum_sums_t
      type(run_spectrum_t) :: result
      type(windows_t) :: windows
      !> Number of the contact whose displacements are signals; 0: there is none
      integer :: contact = 0
      !> Index of the place of the moment
      integer :: place = 1
      !> Index of the recorded point
      integer :: point = 1
      !> Pbar in each signal per unit of the force of each contact, [contacts in the scene's order, signals]
      real(wp), allocatable :: force_weight(:, :)
      !> Start of the first segment, tau
      real(wp) :: start = 0.0_wp
      !> Index of the present half segment, from 0
      integer :: half_index = 0
      !> Integrals over the present (1) and the previous (2) half segment, [frequencies, signals, 2]
      complex(wp), allocatable :: transform(:, :, :)
      !> Changes of these integrals if every second sample is left out, [frequencies, signals, 2]
      complex(wp), allocatable :: change(:, :, :)
      !> Undifferentiated signals at the end of the last interval, [signals]; unallocated: there was no interval
      real(wp), allocatable :: last_values(:)
      !> Signals, differentiated at most once, at the start of the present half segment (1) and at the end of the last
      !> interval (2), [signals, 2]
      real(wp), allocatable :: edge_values(:, :)
      !> Whether the signals at the start of the present half segment have been stored
      logical :: has_start = .false.
      !> Number of events whose impulses have been added
      integer :: events = 0
      !> Cost of the closed forms so far, the number of terms times frequencies times signals
      real(wp) :: cost = 0.0_wp
      !> Limit of this cost
      real(wp) :: cost_limit = huge(1.0_wp)
      !> Time from the start of the first segment after which signals are sampled, tau
      real(wp) :: sampled_from = huge(1.0_wp)
      !> Samples of the present half segment, [0:samples, signals]; unallocated: signals are not sampled yet
      real(wp), allocatable :: samples(:, :)
      !> Differences between exact integrals and sums of samples, summed in magnitude over the intervals of the present
      !> (1) and the previous (2) half segment, [signals, 2]
      real(wp), allocatable :: unsampled(:, :)
   end type spectrum_sums_t

contains

   !> Prepare the integrals of a run.
   subroutine open_spectrum(settings, release_contact, sums)
      !> Settings with &spectrum
      type(run_settings_t), intent(in) :: settings
      !> Number of the release contact, to which histories refer; 0: there is none
      integer, intent(in) :: release_contact
      type(spectrum_sums_t), intent(out) :: sums

      integer :: signals

      associate (requested => settings%spectrum, result => sums%result)
         result%of = requested%of
         result%start = requested%start
         signals = size(requested%of)
         sums%contact = merge(requested%contact, release_contact, requested%contact > 0)
         sums%place = requested%point
         sums%point = requested%recorded_point
         call find_force_weights(settings, sums%force_weight)
         sums%start = requested%start
         sums%cost_limit = requested%closed_form_limit
         call open_windows(requested, min(requested%end, end_of_run(settings%response)) - requested%start, &
            sums%windows, result)
         allocate (sums%transform(size(sums%windows%omega), signals, 2), source=(0.0_wp, 0.0_wp))
         allocate (result%mean(signals), result%sampling_error(signals), source=0.0_wp)
         allocate (sums%edge_values(signals, 2), source=0.0_wp)
      end associate
      if (sums%cost_limit <= 0.0_wp) call start_samples(0.0_wp, sums)
   end subroutine open_spectrum

   !> Find the weights of the contact forces in each signal: a signal is the force of one contact, the sum over all
   !> contacts, or the force upwards on a recorded point.
   pure subroutine find_force_weights(settings, force_weight)
      type(run_settings_t), intent(in) :: settings
      !> Pbar in each signal per unit of the force of each contact, [contacts in the scene's order, signals]
      real(wp), allocatable, intent(out) :: force_weight(:, :)

      type(contact_t), allocatable :: contacts(:)
      integer :: k

      allocate (contacts, source=contacts_of(settings))
      associate (requested => settings%spectrum, point => settings%spectrum%recorded_point)
         allocate (force_weight(size(contacts), size(requested%of)), source=0.0_wp)
         do k = 1, size(requested%of)
            if (signal_table(requested%of(k))%base /= quantity_force) cycle
            if (signal_table(requested%of(k))%is_of_point) then
               force_weight(contacts%number, k) = settings%height_ratio*force_on_point(contacts, point)
            else
               force_weight(contacts%number, k) = merge(settings%height_ratio, 0.0_wp, requested%contact == 0 .or. &
                  contacts%number == requested%contact)
            end if
         end do
      end associate
   end subroutine find_force_weights

   !> Add the integrals over an interval of the motion.
   subroutine add_interval(interval, sums)
      class(interval_t), intent(in) :: interval
      type(spectrum_sums_t), intent(inout) :: sums

      type(exponential_sums_t) :: signals
      real(wp) :: edges(2), from, start, to
      integer :: k

      start = interval%start - sums%start
      if (.not. interval%length > 0.0_wp) return
      if (start + interval%length <= 0.0_wp) return
      if (start >= sums%windows%half*real(sums%windows%halves, wp)) return
      call find_signals(interval, sums, signals)
      call add_jumps(max(start, 0.0_wp), start >= 0.0_wp, interval%length, signals, sums)
      do k = 1, size(sums%result%of)
         ! accelerations follow from the integrals of velocities
         if (signal_table(sums%result%of(k))%derivatives > 0) call differentiate(signals, k)
      end do
      do
         edges = sums%windows%half*real([sums%half_index, sums%half_index + 1], wp)
         from = max(edges(1) - start, 0.0_wp)
         to = min(edges(2) - start, interval%length)
         if (to > from) call add_span(signals, [from, to], start, edges, sums)
         if (edges(2) > start + interval%length .or. sums%half_index == sums%windows%halves - 1) exit
         call end_half(sums)
      end do
      if (sums%cost > sums%cost_limit .and. .not. allocated(sums%samples)) then
         call start_samples(start + interval%length, sums)
      end if
   end subroutine add_interval

   !> Expand the undifferentiated signals over an interval: each is the sum of one or more rows of the interval.
   subroutine find_signals(interval, sums, signals)
      class(interval_t), intent(in) :: interval
      type(spectrum_sums_t), intent(in) :: sums
      type(exponential_sums_t), intent(out) :: signals

      type(exponential_sums_t) :: of_rows
      type(observed_contact_t) :: contact
      ! rows of the interval; for each row the signal to which it is added (`owner`), and the factor
      integer, allocatable :: owner(:), rows(:)
      real(wp), allocatable :: factor(:)
      integer :: i, k

      allocate (rows(0), owner(0), factor(0))
      do k = 1, size(sums%result%of)
         associate (signal => signal_table(sums%result%of(k)))
            if (signal%base == quantity_moment) then
               call add_row(interval%moment_row(sums%place), k, 1.0_wp)
            else if (signal%base == quantity_force .or. signal%is_of_contact) then
               do i = 1, interval%contacts
                  contact = interval%contact(i)
                  if (signal%base /= quantity_force) then
                     if (contact%number == sums%contact) call add_row(i, k, contact%sign)
                  else if (contact%is_closed .and. abs(sums%force_weight(contact%number, k)) > 0.0_wp) then
                     call add_row(interval%force_row(i), k, sums%force_weight(contact%number, k))
                  end if
               end do
            else
               call add_row(interval%displacement_row(merge(sums%point, 0, signal%is_of_point)), k, 1.0_wp)
            end if
         end associate
      end do
      call interval%expand_in_exponentials(rows, of_rows)
      call open_sums(size(sums%result%of), size(of_rows%exponent), signals)
      signals%exponent = of_rows%exponent
      do i = 1, size(rows)
         signals%power(:, owner(i)) = signals%power(:, owner(i)) + factor(i)*of_rows%power(:, i)
         signals%amplitude(owner(i), :) = signals%amplitude(owner(i), :) + factor(i)*of_rows%amplitude(i, :)
      end do

   contains

      !> Add a row of the interval to a signal.
      subroutine add_row(row, signal, by)
         integer, intent(in) :: row
         integer, intent(in) :: signal
         !> Factor of the row
         real(wp), intent(in) :: by

         rows = [rows, row]
         owner = [owner, signal]
         factor = [factor, by]
      end subroutine add_row
   end subroutine find_signals

   !> Add the jumps of the undifferentiated signals between two intervals: an impulse in the derivative of the signal.
   !> (Displacements by Newmark's method may jump by a projection onto a contact.)
   subroutine add_jumps(time, is_within, length, signals, sums)
      !> Time from the start of the first segment to the start of the interval
      real(wp), intent(in) :: time
      !> Whether the interval starts within the segments
      logical, intent(in) :: is_within
      !> Length of the interval
      real(wp), intent(in) :: length
      !> Undifferentiated signals
      type(exponential_sums_t), intent(in) :: signals
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp) :: jump(size(sums%result%of))
      integer :: k

      if (all(signal_table(sums%result%of)%derivatives == 0)) return
      if (allocated(sums%last_values) .and. is_within) then
         jump = value_of(signals, 0.0_wp) - sums%last_values
         do k = 1, size(jump)
            if (signal_table(sums%result%of(k))%derivatives > 0) call add_impulse(sums%windows%omega, time, jump(k), &
               sums%transform(:, k, 1))
         end do
      end if
      sums%last_values = value_of(signals, length)
   end subroutine add_jumps

   !> Add the span of an interval that lies within the present half segment, in closed form or as samples.
   subroutine add_span(signals, span, start, edges, sums)
      type(exponential_sums_t), intent(in) :: signals
      !> Ends of the span, since the start of the interval
      real(wp), intent(in) :: span(2)
      !> Start of the interval, since the start of the first segment
      real(wp), intent(in) :: start
      !> Ends of the half segment, since the start of the first segment
      real(wp), intent(in) :: edges(2)
      type(spectrum_sums_t), intent(inout) :: sums

      ! end of the part of the span that is integrated in closed form
      real(wp) :: closed_to
      integer :: n

      if (.not. sums%has_start) sums%edge_values(:, 1) = value_of(signals, span(1))
      sums%has_start = .true.
      sums%edge_values(:, 2) = value_of(signals, span(2))
      closed_to = min(span(2), sums%sampled_from - start)
      associate (windows => sums%windows)
         if (closed_to > span(1)) then
            do n = 1, size(windows%blocks, 2)
               associate (block => windows%blocks(:, n))
                  call add_fourier_integrals(signals, span(1), closed_to, start, windows%omega(block(1):block(2)), &
                     sums%transform(block(1):block(2), :, 1))
               end associate
            end do
            sums%cost = sums%cost + real((size(signals%exponent) + 1)*size(sums%edge_values, 1), wp) &
               *real(size(windows%omega), wp)
         end if
      end associate
      if (.not. allocated(sums%samples) .or. closed_to >= span(2)) return
      call take_samples(signals, [max(closed_to, span(1)), span(2)], start - edges(1), sums)
   end subroutine add_span

   !> Sample a span, and record by how much its exact integral differs from the sum of the samples: the force of a
   !> damper can begin and end between two samples, so that a comparison of all samples with every second sample would
   !> not show this error.
   subroutine take_samples(signals, span, start, sums)
      type(exponential_sums_t), intent(in) :: signals
      !> Ends of the span, since the start of the interval
      real(wp), intent(in) :: span(2)
      !> Start of the interval, since the start of the half segment
      real(wp), intent(in) :: start
      type(spectrum_sums_t), intent(inout) :: sums

      ! instants that differ by at most this fraction of a sampling step are the same
      real(wp), parameter :: same = 1.0e-6_wp
      complex(wp) :: integral(1, size(sums%unsampled, 1))
      real(wp) :: sampled(size(sums%unsampled, 1)), values(size(sums%unsampled, 1))
      ! each sample stands for the step about it, so that the samples of the span stand for the time from
      ! span(1) - lead(1) to span(2) - lead(2)
      real(wp) :: lead(2), time
      integer :: first, last, n
      ! whether the sampled part of the half segment begins with the span
      logical :: is_first

      associate (step => sums%result%step)
         first = max(0, ceiling((start + span(1))/step - same))
         last = ubound(sums%samples, 1)
         is_first = start + span(1) <= max(0.0_wp, sums%sampled_from - sums%windows%half*real(sums%half_index, wp)) &
            + same*step
         sampled = 0.0_wp
         do n = first, last
            time = real(n, wp)*step - start
            ! a sample at an instant that two intervals have in common belongs to the later interval; the last sample of
            ! the half segment belongs to the interval that ends at this sample
            if (time >= span(2) - same*step .and. .not. (n == last .and. time <= span(2) + same*step)) exit
            values = value_of(signals, min(max(time, span(1)), span(2)))
            sums%samples(n, :) = values
            ! trapezoidal rule: the first and the last sample of the half segment stand for half a step
            sampled = sampled + step*merge(0.5_wp, 1.0_wp, n == last .or. (n == first .and. is_first))*values
         end do
         if (size(signals%exponent) == 0) return
         ! the first sample at or after an end of the span stands for the time from half a step before it
         associate (end_in_steps => (start + span)/step)
            lead = step*(0.5_wp - (ceiling(end_in_steps - same) - end_in_steps))
         end associate
         if (is_first) lead(1) = 0.0_wp
         if (start + span(2) >= (real(last, wp) - same)*step) lead(2) = 0.0_wp
         integral = (0.0_wp, 0.0_wp)
         call add_fourier_integrals(signals, span(1), span(2), 0.0_wp, [0.0_wp], integral)
         sums%unsampled(:, 1) = sums%unsampled(:, 1) + abs(real(integral(1, :), wp) - sampled &
            + lead(1)*value_of(signals, span(1)) - lead(2)*value_of(signals, span(2)))
      end associate
   end subroutine take_samples

   !> Begin to sample the signals at an instant, or at the next sampling instant.
   subroutine start_samples(time, sums)
      !> Time since the start of the first segment
      real(wp), intent(in) :: time
      type(spectrum_sums_t), intent(inout) :: sums

      integer :: samples

      associate (windows => sums%windows)
         ! an even number of steps, so that every second sample is a trapezoidal rule, too
         samples = 2*ceiling(0.5_wp*max(real(min_samples, wp), samples_per_period*maxval(abs(windows%omega)) &
            *windows%half/(2.0_wp*pi)))
         sums%result%step = windows%half/real(samples, wp)
         sums%sampled_from = 2.0_wp*sums%result%step*ceiling(0.5_wp*max(time, 0.0_wp)/sums%result%step)
         sums%result%sampled_from = sums%start + sums%sampled_from
         allocate (sums%samples(0:samples, size(sums%result%of)), source=0.0_wp)
         allocate (sums%unsampled(size(sums%result%of), 2), source=0.0_wp)
         allocate (sums%change, mold=sums%transform)
         sums%change(:, :, :) = (0.0_wp, 0.0_wp)
      end associate
   end subroutine start_samples

   !> Add the impulses of rigid stops at new events of a response to the transforms of forces.
   subroutine take_impulses(response, sums)
      type(response_t), intent(in) :: response
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp) :: impulse, time
      integer :: i, k

      do i = sums%events + 1, response%event_count
         associate (event => response%events(i))
            time = event%tau - sums%start
            if (time < 0.0_wp .or. time >= sums%windows%half*real(sums%windows%halves, wp)) cycle
            do k = 1, size(sums%result%of)
               impulse = sums%force_weight(event%contact, k)*event%impulse
               if (.not. abs(impulse) > 0.0_wp) cycle
               call add_impulse(sums%windows%omega, time, impulse, sums%transform(:, k, 1))
            end do
         end associate
      end do
      sums%events = response%event_count
   end subroutine take_impulses

   !> Finish the present half segment and, if it is the second half of a segment, the segment.
   subroutine end_half(sums)
      type(spectrum_sums_t), intent(inout) :: sums

      integer :: k

      if (allocated(sums%samples)) call transform_samples(sums)
      call differentiate_transforms(sums)
      associate (result => sums%result, windows => sums%windows)
         do k = 1, size(result%of)
            ! the integral at frequency 0, over the length of all half segments
            result%mean(k) = result%mean(k) + real(sums%transform(windows%zero(0), k, 1), wp) &
               /(windows%half*real(windows%halves, wp))
         end do
         if (windows%kind /= window_hann .or. sums%half_index > 0) call end_segment(sums)
      end associate
      sums%transform(:, :, 2) = sums%transform(:, :, 1)
      sums%transform(:, :, 1) = (0.0_wp, 0.0_wp)
      if (allocated(sums%change)) then
         sums%change(:, :, 2) = sums%change(:, :, 1)
         sums%change(:, :, 1) = (0.0_wp, 0.0_wp)
         sums%unsampled(:, 2) = sums%unsampled(:, 1)
         sums%unsampled(:, 1) = 0.0_wp
      end if
      sums%half_index = sums%half_index + 1
      sums%has_start = .false.
   end subroutine end_half

   !> Transforms of accelerations from those of velocities, by integration by parts: i omega times the transform of the
   !> velocity plus its values at both ends. The sum of the impulses and short intervals of an acceleration would lose
   !> digits by cancellation.
   subroutine differentiate_transforms(sums)
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp) :: edges(2)
      integer :: k

      edges = sums%windows%half*real([sums%half_index, sums%half_index + 1], wp)
      do k = 1, size(sums%result%of)
         if (signal_table(sums%result%of(k))%derivatives < 2) cycle
         associate (i_omega => cmplx(0.0_wp, sums%windows%omega, wp))
            sums%transform(:, k, 1) = i_omega*sums%transform(:, k, 1)
            call add_impulse(sums%windows%omega, edges(1), -sums%edge_values(k, 1), sums%transform(:, k, 1))
            call add_impulse(sums%windows%omega, edges(2), sums%edge_values(k, 2), sums%transform(:, k, 1))
            if (.not. allocated(sums%change)) cycle
            sums%change(:, k, 1) = i_omega*sums%change(:, k, 1)
            sums%unsampled(k, 1) = maxval(abs(sums%windows%omega))*sums%unsampled(k, 1)
         end associate
      end do
   end subroutine differentiate_transforms

   !> Add the samples of a half segment to its integrals by the trapezoidal rule, and record by how much the integrals
   !> change if every second sample is left out.
   subroutine transform_samples(sums)
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp), allocatable :: weighted(:)
      complex(wp), allocatable :: fine(:), coarse(:)
      real(wp) :: edge, spacing
      integer :: first, k, last, n

      last = ubound(sums%samples, 1)
      edge = sums%windows%half*real(sums%half_index, wp)
      first = max(0, nint((sums%sampled_from - edge)/sums%result%step))
      if (first >= last) return
      associate (windows => sums%windows, step => sums%result%step)
         do k = 1, size(sums%result%of)
            allocate (weighted, source=step*sums%samples(first:last, k))
            weighted([1, size(weighted)]) = 0.5_wp*weighted([1, size(weighted)])
            do n = 1, size(windows%blocks, 2)
               associate (block => windows%blocks(:, n))
                  spacing = 0.0_wp
                  if (block(2) > block(1)) spacing = windows%omega(block(1) + 1) - windows%omega(block(1))
                  allocate (fine, source=fourier_sums(weighted, edge + real(first, wp)*step, step, &
                     windows%omega(block(1)), spacing, block(2) - block(1) + 1))
                  allocate (coarse, source=fourier_sums(2.0_wp*weighted(::2), edge + real(first, wp)*step, &
                     2.0_wp*step, windows%omega(block(1)), spacing, block(2) - block(1) + 1))
                  sums%transform(block(1):block(2), k, 1) = sums%transform(block(1):block(2), k, 1) + fine
                  sums%change(block(1):block(2), k, 1) = sums%change(block(1):block(2), k, 1) + (coarse - fine)
                  deallocate (fine, coarse)
               end associate
            end do
            deallocate (weighted)
         end do
      end associate
      sums%samples(:, :) = 0.0_wp
   end subroutine transform_samples

   !> Add the power of a finished segment to the mean powers and to their scatter.
   subroutine end_segment(sums)
      type(spectrum_sums_t), intent(inout) :: sums

      complex(wp) :: segment(size(sums%result%frequency))
      real(wp) :: power(size(sums%result%frequency)), deviation(size(sums%result%frequency))
      integer :: k

      associate (result => sums%result, windows => sums%windows)
         result%segments = result%segments + 1
         do k = 1, size(result%of)
            segment = transforms_of(windows, sums%transform(:, k, :), result%segments - 1)
            power = real(segment, wp)**2 + aimag(segment)**2
            ! Welford's update: sums of squares would cancel
            deviation = power - result%power(:, k)
            result%power(:, k) = result%power(:, k) + deviation/real(result%segments, wp)
            result%scatter(:, k) = result%scatter(:, k) + deviation*(power - result%power(:, k))
            if (.not. allocated(sums%change)) cycle
            segment = transforms_of(windows, sums%change(:, k, :), result%segments - 1)
            result%sampling_error(k) = max(result%sampling_error(k), maxval(abs(segment)) &
               + sum(sums%unsampled(k, :merge(2, 1, windows%kind == window_hann))))
         end do
      end associate
   end subroutine end_segment

   !> Finish the last half segment at the end of the run, and return the powers.
   subroutine finish_spectrum(sums, spectrum)
      type(spectrum_sums_t), intent(inout) :: sums
      type(run_spectrum_t), allocatable, intent(out) :: spectrum

      if (sums%half_index == sums%windows%halves - 1) call end_half(sums)
      allocate (spectrum, source=sums%result)
   end subroutine finish_spectrum

end module run_spectra
